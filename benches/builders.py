#!/usr/bin/env python3
"""Builds and traces the same meshes with every builder and with an Embree driver in turn, and prints tables as Markdown.

usage: builders.py TABLE BASE [--meshes NAME ...] [--vastlight PATH] [--rounds N] [--threads N]

TABLE is
  rates      build rates beside Embree low and medium: the fastest, the default, the grid builder
  splitting  ray rates of each builder whole and with budgets of 1.1, 1.5 and 2, against spatial splits
  quality    build times by stage, memory, cost and ray rates of each builder, spatial splits being 100 %
BASE holds embree_bench/embree_bench, meshes/NAME.ply and rays/NAME.{primary,diffuse,shadow}.rays. Programs take turns
round by round, because machines drift; each keeps its best round, so more rounds are fairer on a busy machine.
"""
import argparse
import json
import pathlib
import subprocess

KINDS = ("primary", "diffuse", "shadow")
BUILDERS = ("binned-sah", "grid-sah", "hlbvh2", "hlbvh2-binned", "morton", "ploc")


def json_line(command):
    """Runs a command and reads the last JSON line that it prints."""
    out = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout
    return json.loads([line for line in out.splitlines() if line.startswith("{")][-1])


def build(args, mesh, accel, budget=None, repeat=5):
    command = [args.vastlight, "bench", "build", args.base / f"meshes/{mesh}.ply", "--accel", accel]
    command += ["-t", args.threads, "--repeat", repeat]
    return json_line(command + (["--split-budget", budget] if budget else []))


def embree_build(args, mesh, quality, repeat=5):
    rays = sorted((args.base / "rays").glob("*.primary.rays"))[0]
    command = [args.base / "embree_bench/embree_bench", args.base / f"meshes/{mesh}.ply", rays, "--reps", 1]
    line = json_line(command + ["--builds", repeat, "--threads", args.threads, "--quality", quality])
    return dict(build_ms=line["build_ms_best"], cpu_ms=line["build_cpu_ms"], bytes_per_triangle=line["bvh_B_per_tri"],
                peak_build_bytes_per_triangle=line["build_peak_B_per_tri"], triangles=line["tris"])


def rays(args, mesh, accel, budget=None):
    """Millions of rays in a second of processor time, by kind."""
    rates = {}
    for kind in KINDS:
        file = args.base / f"rays/{mesh}.{kind}.rays"
        command = [args.vastlight, "bench", "trace", args.base / f"meshes/{mesh}.ply", "--rays", file, "--repeat", 4]
        command += ["-t", args.threads, "--accel", accel] + (["--occluded"] if kind == "shadow" else [])
        line = json_line(command + (["--split-budget", budget] if budget else []))
        rates[kind] = line["mrays_per_cpu_s"]
    return rates


def take_turns(args, jobs):
    """The answers of jobs (by name), round by round; of numbers the best."""
    best = {}
    for _ in range(args.rounds):
        for name, job in jobs.items():
            answer = job()
            kept = best.setdefault(name, answer)
            for key, value in answer.items():
                if key in ("build_ms", "cpu_ms"):
                    kept[key] = min(kept[key], value)
                elif key in KINDS:
                    kept[key] = max(kept[key], value)
                elif key == "stages":
                    kept[key] = {stage: min(ms, kept[key].get(stage, ms)) for stage, ms in value.items()}
    return best


def row(*cells):
    print("| " + " | ".join(f"{c:.1f}" if isinstance(c, float) else str(c) for c in cells) + " |")


def rates_table(args):
    row("mesh", "builder", "build ms", "cpu ms", "Mtri/s", "rate / low", "rate / medium", "cpu low / own",
        "cpu medium / own", "B/tri", "peak B/tri")
    print("|---" * 11 + "|")
    for mesh in args.meshes:
        jobs = {f"Embree {q}": lambda q=q: embree_build(args, mesh, q) for q in ("low", "medium")}
        for accel in ("hlbvh2", "hlbvh2-binned", "morton", "grid-sah", "binned-sah"):
            jobs[accel] = lambda accel=accel: build(args, mesh, accel)
        best = take_turns(args, jobs)
        low, medium = best["Embree low"], best["Embree medium"]
        for name, b in best.items():
            ratios = [f"{e[key] / b[key]:.2f}" for key in ("build_ms", "cpu_ms") for e in (low, medium)]
            row(mesh, name, b["build_ms"], b["cpu_ms"], b["triangles"] / b["build_ms"] / 1e3, *ratios,
                b["bytes_per_triangle"], b["peak_build_bytes_per_triangle"])


def splitting_table(args):
    for mesh in args.meshes:
        jobs = {("sbvh", b): lambda b=b: build(args, mesh, "sbvh", b, 1) | rays(args, mesh, "sbvh", b) for b in (1.5, 2)}
        for accel in BUILDERS:
            for budget in (1, None, 1.1, 1.5, 2):
                jobs[accel, budget] = lambda a=accel, b=budget: build(args, mesh, a, b, 3) | rays(args, mesh, a, b)
        best = take_turns(args, jobs)
        top = best["sbvh", 2]
        row(mesh, "budget", "references", "build ms", "cpu ms", *KINDS, "of sbvh's")
        print("|---" * 9 + "|")
        for (accel, budget), b in best.items():
            part = sum(b[k] / top[k] for k in KINDS) / len(KINDS)
            label = {None: "automatic", 1: "whole"}.get(budget, budget)
            row(accel, label, f"{100 * b['references'] / b['triangles']:.0f} %", b["build_ms"], b["cpu_ms"],
                *(f"{b[k]:.2f}" for k in KINDS), f"{100 * part:.0f} %")


def quality_table(args):
    for mesh in args.meshes:
        jobs = {a: lambda a=a: build(args, mesh, a, None, 3) | rays(args, mesh, a) for a in BUILDERS}
        jobs["sbvh"] = lambda: build(args, mesh, "sbvh", 2, 1) | rays(args, mesh, "sbvh", 2)
        best = take_turns(args, jobs)
        top = best["sbvh"]
        row(mesh, "references", "nodes", "peak B/tri", "kept B/tri", "depth", "overlap", "build ms", "stages, ms", "1/C(root)", "rays")
        print("|---" * 11 + "|")
        for name, b in best.items():
            part = sum(b[k] / top[k] for k in KINDS) / len(KINDS)
            stages = ", ".join(f"{stage} {ms:.0f}" for stage, ms in b["stages"].items() if ms >= 0.5)
            row(name, f"{100 * b['references'] / b['triangles']:.0f} %", b["nodes"], b["peak_build_bytes_per_triangle"],
                b["bytes_per_triangle"], b["depth"], f"{b['overlap']:.3f}", b["build_ms"], stages,
                f"{100 * top['cost'] / b['cost']:.0f} %", f"{100 * part:.0f} %")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tables = dict(rates=rates_table, splitting=splitting_table, quality=quality_table)
    parser.add_argument("table", choices=tables)
    parser.add_argument("base", type=pathlib.Path)
    parser.add_argument("--meshes", nargs="+", default=["uniform1M"])
    parser.add_argument("--vastlight", default="target/release/vastlight")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    tables[args.table](args)


if __name__ == "__main__":
    main()
