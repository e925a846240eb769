#!/usr/bin/env python3
"""Traces the same ray files with vastlight and with an Embree driver in turn, and prints rates side by side.

usage: against_embree.py BASE [--vastlight PATH] [--rounds N] [--threads N] [--quality low|medium|high]
                         [--packets] [--extra ARGUMENT ...]

BASE holds embree_bench/embree_bench (a driver that prints one JSON line with Mrays_s_best, bvh_B_per_tri, hits, sum_t),
meshes/NAME.ply and rays/NAME.{primary,diffuse,shadow}.rays. The programs alternate (A B A B ...) because machines
drift; each side keeps its best round. With --packets Embree gets primary rays in coherent packets of 16, and only those
are traced. --extra comes last: what follows it is handed to vastlight.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys


def json_line(command):
    """Runs a command and reads the last JSON line that it prints."""
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads([line for line in out.splitlines() if line.startswith("{")][-1])


def embree(base, mesh, kind, args):
    command = [base / "embree_bench/embree_bench", mesh, rays_of(base, mesh, kind), "--threads", args.threads]
    command += ["--quality", args.quality] + (["--any"] if kind == "shadow" else [])
    command += ["--packet", "16", "--coherent"] if args.packets else []
    line = json_line([str(part) for part in command])
    return dict(rate=line["Mrays_s_best"], bytes=line["bvh_B_per_tri"], build=line["build_ms_best"],
                hits=line["hits"], sum_t=line["sum_t"])


def vastlight(base, mesh, kind, args):
    command = [args.vastlight, "bench", "trace", mesh, "--rays", rays_of(base, mesh, kind), "-t", args.threads]
    command += ["--repeat", "5"] + (["--occluded"] if kind == "shadow" else []) + args.extra
    line = json_line([str(part) for part in command])
    return dict(rate=line["mrays_per_s"], bytes=line["bytes_per_triangle"], build=line["build_ms"],
                hits=line["hits"], sum_t=line["sum_t"])


def rays_of(base, mesh, kind):
    return base / "rays" / f"{mesh.stem}.{kind}.rays"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=pathlib.Path)
    parser.add_argument("--vastlight", default="target/release/vastlight")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--packets", action="store_true")
    parser.add_argument("--extra", nargs=argparse.REMAINDER, default=[], help="more arguments for vastlight")
    args = parser.parse_args()
    ratios = []
    print(f"{'set':24} {'vastlight':>9} {'Embree':>8} {'ratio':>6}   bytes/tri     build ms       hits            sum_t")
    for mesh in sorted((args.base / "meshes").glob("*.ply")):
        for kind in ("primary",) if args.packets else ("primary", "diffuse", "shadow"):
            if not rays_of(args.base, mesh, kind).exists():
                continue
            runs = [(vastlight(args.base, mesh, kind, args), embree(args.base, mesh, kind, args))
                    for _ in range(args.rounds)]
            ours, theirs = (max((r[side] for r in runs), key=lambda r: r["rate"]) for side in (0, 1))
            ratios.append(ours["rate"] / theirs["rate"])
            print(f"{mesh.stem + ' ' + kind:24} {ours['rate']:9.2f} {theirs['rate']:8.2f} {ratios[-1]:6.2f}"
                  f"   {ours['bytes']:5.1f} {theirs['bytes']:5.1f}   {ours['build']:6.0f} {theirs['build']:6.0f}"
                  f"   {ours['hits']} {theirs['hits']}   {ours['sum_t']:.2f} {theirs['sum_t']:.2f}")
    if not ratios:
        sys.exit(f"{args.base}: no mesh with ray files")
    print(f"geometric mean {math.exp(sum(map(math.log, ratios)) / len(ratios)):.3f}, worst {min(ratios):.3f}")


if __name__ == "__main__":
    main()
