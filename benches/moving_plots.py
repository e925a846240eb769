"""Draws what `vastlight bench update` and `vastlight bench clusters` measured.

    vastlight bench update demo:bodies -f 0-95x2 -r 240x180 --method clustered,refit,rebuild,auto > m/update-bodies.jsonl
    vastlight bench clusters demo:bodies -f 0-95x8 -r 480x360 > m/clusters-bodies.jsonl
    vastlight bench clusters demo:bodies -f 0-95x8 -r 480x360 --heuristic naive,error --max-count 50 >> m/clusters-bodies.jsonl
    python3 benches/moving_plots.py m docs/algorithms

for each of bodies, explosion and cloth, with matplotlib. The plots have the form of figures 2.7 to 2.10 and 3.11 to 3.14 of
Garanzha's thesis of 2014.
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SEQUENCES = ["explosion", "bodies", "cloth"]
COLORS = {"clustered": "#0072b2", "refit": "#d55e00", "rebuild": "#555555", "auto": "#009e73"}


def read(folder, name):
    """The lines of a file of results."""
    return [json.loads(line) for line in (folder / f"{name}.jsonl").read_text().splitlines()]


def finish(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=72)
    plt.close(figure)


def updates(folder, target):
    """Time, share of nodes that are rebuilt or put elsewhere, rays over the updated tree; a column a sequence."""
    figure, axes = plt.subplots(3, 3, figsize=(13, 9.5), sharex="col")
    for (top, middle, bottom), sequence in zip(axes.T, SEQUENCES):
        lines = [line for line in read(folder, f"update-{sequence}") if "time" in line]
        for method, color in COLORS.items():
            of_method = [line for line in lines if line["method"] == method][1:]
            times = [line["time"] for line in of_method]
            top.plot(times, [line["update_ms"] for line in of_method], color=color, label=method)
            bottom.plot(times, [line["trace_ratio"] for line in of_method], color=color)
            if method == "clustered":
                middle.plot(times, [100 * line["rebuilt_fraction"] for line in of_method], color=color, label="rebuilt")
                moved = [100 * line["migrated_fraction"] for line in of_method]
                middle.plot(times, moved, color="#cc79a7", label="migrated")
        top.set(title=f"demo:{sequence}", ylabel="update, ms", yscale="log")
        middle.set(ylabel="nodes of a clustered update, %", yscale="symlog", ylim=(0, 110))
        bottom.set(ylabel="rays/s, fresh tree = 1", xlabel="time, s", ylim=(0, 1.3))
        bottom.axhline(1.0, color="#bbbbbb", linewidth=0.8, zorder=0)
    axes[0][0].legend(frameon=False, ncols=2)
    axes[1][0].legend(frameon=False)
    finish(figure, target / "moving-updates.png")


def clusters(folder, target):
    """Build and trace time over the size of clusters; rays against no clusters and the other heuristics, by frame."""
    figure, axes = plt.subplots(2, 3, figsize=(13, 6.5))
    for (top, bottom), sequence in zip(axes.T, SEQUENCES):
        lines = read(folder, f"clusters-{sequence}")
        acc = [line for line in lines if line["heuristic"] == "acc"]
        sizes = ["none"] + [str(line["max_count"]) for line in acc]
        without = acc[0]["build_ms_without"], acc[0]["trace_ms"] * acc[0]["trace_ratio"]
        build = [without[0]] + [line["build_ms"] for line in acc]
        trace = [without[1]] + [line["trace_ms"] for line in acc]
        top.bar(sizes, build, color="#0072b2", label="build")
        top.bar(sizes, trace, bottom=build, color="#e69f00", label="rays")
        top.set(title=f"demo:{sequence}", xlabel="MaxCount = MaxSize", ylabel="ms a frame")
        (at50,) = [line for line in acc if line["max_count"] == 50]
        bottom.plot(at50["frame_trace_ratio"], color="#555555", label="no clusters")
        for heuristic, color in (("naive", "#d55e00"), ("error", "#009e73")):
            (other,) = [line for line in lines if line["heuristic"] == heuristic]
            pairs = zip(other["frame_trace_ms"], at50["frame_trace_ms"])
            bottom.plot([theirs / ours for theirs, ours in pairs], color=color, label=heuristic)
        bottom.set(xlabel="frame / 8", ylabel="rays/s of Acc(50) over those of", ylim=(0.7, 1.4))
        bottom.axhline(1.0, color="#bbbbbb", linewidth=0.8, zorder=0)
    axes[0][0].legend(frameon=False)
    axes[1][0].legend(frameon=False)
    finish(figure, target / "moving-clusters.png")


if __name__ == "__main__":
    folder, target = map(pathlib.Path, sys.argv[1:3])
    updates(folder, target)
    clusters(folder, target)
