#!/usr/bin/env python3
"""A mesh that does not fit: vastlight beside Embree and Mitsuba, all within the same memory cgroup.

    benches/beyond_memory.py BASE [--triangles 30000000] [--limit-mib 1024] [--binary target/release/vastlight]

BASE is a folder with embree_bench/embree_bench, c_mitsuba.py, a .venv with Mitsuba and rays/*.rays (as made for
against_embree.py). Needs numpy, and the right to make a memory cgroup. Prints one JSON line for each program: whether it came to its end,
the signal that ended it, seconds, and the most memory that it had, page cache of the kernel left out.
"""

import argparse
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

import numpy

ROOTS = {1: pathlib.Path("/sys/fs/cgroup/memory"), 2: pathlib.Path("/sys/fs/cgroup")}
LIMIT_FILES = {1: "memory.limit_in_bytes", 2: "memory.max"}


class Cgroup:
    """A memory cgroup for as long as the block lasts."""

    def __init__(self, limit_bytes):
        version = 2 if (ROOTS[2] / "cgroup.controllers").exists() else 1
        self.path = ROOTS[version] / f"vastlight-{os.getpid()}"
        self.limit = (LIMIT_FILES[version], str(limit_bytes))

    def __enter__(self):
        self.path.mkdir()
        (self.path / self.limit[0]).write_text(self.limit[1])
        return self

    def __exit__(self, *_):
        self.path.rmdir()

    def run(self, command, environment):
        """Runs a command inside; gives its status, seconds and peak resident set in MiB."""
        join = lambda: (self.path / "cgroup.procs").write_text(str(os.getpid()))
        begin = time.monotonic()
        process = subprocess.Popen(
            command, preexec_fn=join, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        message = process.stderr.read().decode(errors="replace").strip().splitlines()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = 0
        return os.waitstatus_to_exitcode(status), time.monotonic() - begin, usage.ru_maxrss / 1024, message


TYPES = {"float": "<f4", "uchar": "u1"}


def strip(source, target):
    """Writes a PLY file again with nothing but positions and triangles, as the Embree driver reads it."""
    with source.open("rb") as file, target.open("wb") as out:
        properties, vertices = [], 0
        while (words := file.readline().split()) != [b"end_header"]:
            if words[:2] == [b"element", b"vertex"]:
                vertices = int(words[2])
            is_value = words[0] == b"property" and words[1] != b"list"
            if is_value:
                properties.append((words[2].decode(), TYPES[words[1].decode()]))
            if not is_value or words[2] in (b"x", b"y", b"z"):
                out.write(b" ".join(words) + b"\n")
        out.write(b"end_header\n")
        record = numpy.dtype(properties)
        for first in range(0, vertices, 1 << 20):
            rows = numpy.fromfile(file, record, min(1 << 20, vertices - first))
            out.write(numpy.stack([rows[axis] for axis in "xyz"], axis=1).tobytes())
        shutil.copyfileobj(file, out)


def commands(arguments, folder):
    """What is run, by name."""
    base, limit = arguments.base, f"{arguments.limit_mib}MiB"
    mesh, store = folder / "mesh.ply", folder / "mesh.vls"
    rays = next((base / "rays").glob("*.rays"))
    picture = ["-r", "640x480", "--spp", "16", "-q", "-o", folder / "picture.png"]
    return {
        "embree": [base / "embree_bench/embree_bench", mesh, rays, "--reps", "1", "--builds", "1"],
        "embree compact": [
            base / "embree_bench/embree_bench", mesh, rays, "--compact", "--reps", "1", "--builds", "1",
        ],
        "mitsuba": [base / ".venv/bin/python", base / "c_mitsuba.py", "llvm_ad_rgb", mesh, "16", "1"],
        "vastlight in memory": [arguments.binary, "render", mesh, "--memory", limit, *picture],
        "vastlight pack": [arguments.binary, "pack", mesh, "-o", store, "--memory", limit, "-q"],
        "vastlight render": [arguments.binary, "render", store, "--memory", limit, *picture],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("base", type=pathlib.Path)
    parser.add_argument("--triangles", type=int, default=30_000_000)
    parser.add_argument("--limit-mib", type=int, default=1024)
    parser.add_argument("--binary", type=pathlib.Path, default=pathlib.Path("target/release/vastlight"))
    parser.add_argument("--folder", type=pathlib.Path, help="for the mesh and the store [default: a temporary one]")
    arguments = parser.parse_args()
    environment = {**os.environ, "BASE": str(arguments.base)}
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
        folder = pathlib.Path(name)
        generate = [arguments.binary, "generate", "plant", "--triangles", str(arguments.triangles), "-q"]
        subprocess.run([*generate, "-o", folder / "full.ply"], check=True)
        strip(folder / "full.ply", folder / "mesh.ply")
        (folder / "full.ply").unlink()
        for program, command in commands(arguments, folder).items():
            with Cgroup(arguments.limit_mib << 20) as cgroup:
                code, seconds, peak, message = cgroup.run(list(map(str, command)), environment)
            ended = "done" if code == 0 else signal.Signals(-code).name if code < 0 else f"exit code {code}"
            line = {"bench": "beyond_memory", "program": program, "triangles": arguments.triangles}
            line |= {"limit_mib": arguments.limit_mib, "ended": ended, "seconds": round(seconds, 1)}
            line |= {"peak_mib": round(peak), "message": message[-1] if message and code else ""}
            print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
