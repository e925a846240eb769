"""Rays as arrays from Python, beside the command line's benchmark, Embree's wheel (embreex) and Open3D's caster, on the same rays.

    python benches/python_rays.py target/release/vastlight [--triangles 1000000] [--threads 2]

needs the package `vastlight` and NumPy; embreex and Open3D are measured where they are installed. A line for each mesh, set of rays and program: millions
of rays a second, best of some runs, and the number of hits.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import vastlight as vl

REPEATS = 7
SIDE = 1024


def rate(trace: Callable[[], int], rays: int) -> tuple[float, int]:
    """Millions of rays a second, and what was answered."""
    best, hits = float("inf"), 0
    for _ in range(REPEATS):
        start = time.perf_counter()
        hits = trace()
        best = min(best, time.perf_counter() - start)
    return rays / best / 1e6, hits


def sets_of_rays(scene: vl.Scene) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Rays of a camera, row by row, and rays that bounce from what they hit."""
    low, high = scene.bounds
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    eye = middle + size * np.array([0.5, 0.45, 0.6])
    forward = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    x, y = np.meshgrid((np.arange(SIDE) + 0.5) / SIDE - 0.5, 0.5 - (np.arange(SIDE) + 0.5) / SIDE)
    ways = forward + 0.9 * (x[..., None] * right + y[..., None] * np.cross(right, forward))
    ways = ways.reshape(-1, 3).astype(np.float32)
    starts = np.broadcast_to(eye.astype(np.float32), ways.shape).copy()
    yield "primary", starts, ways
    hits = scene.trace(starts, ways)
    pick = np.resize(np.flatnonzero(np.isfinite(hits.t)), len(ways))
    normal = hits.normal[pick]
    normal = np.where((normal * ways[pick]).sum(1, keepdims=True) > 0, -normal, normal)
    spread = np.random.default_rng(0).normal(size=normal.shape)
    spread /= np.linalg.norm(spread, axis=1, keepdims=True)
    place = starts[pick] + hits.t[pick, None] * ways[pick] + 1e-4 * size * normal
    yield "diffuse", place.astype(np.float32), (normal + 0.99 * spread).astype(np.float32)


def native(command: str, mesh: Path, starts: np.ndarray, ways: np.ndarray, threads: int) -> tuple[float, int]:
    """The command line's benchmark."""
    rays = np.zeros((len(starts), 8), np.float32)
    rays[:, :3], rays[:, 4:7], rays[:, 7] = starts, ways, 1e30
    file = mesh.with_suffix(".rays")
    rays.tofile(file)
    words = [command, "bench", "trace", mesh, "--rays", file, "--repeat", str(REPEATS), "-t", str(threads)]
    line = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    return line["mrays_per_s"], line["hits"]


def embreex(vertices: np.ndarray, faces: np.ndarray) -> Callable[[np.ndarray, np.ndarray], int]:
    """Embree through embreex: one thread."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))
    return lambda starts, ways: int((scene.run(starts, ways) >= 0).sum())


def open3d(vertices: np.ndarray, faces: np.ndarray, threads: int) -> Callable[[np.ndarray, np.ndarray], int]:
    """Open3D's caster, Embree below."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(faces.astype(np.uint32)))

    def cast(starts: np.ndarray, ways: np.ndarray) -> int:
        rays = open3d.core.Tensor(np.concatenate([starts, ways], axis=1))
        return int(np.isfinite(scene.cast_rays(rays, nthreads=threads)["t_hit"].numpy()).sum())

    return cast


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command")
    parser.add_argument("--triangles", default="1000000")
    parser.add_argument("--threads", type=int, default=min(2, os.cpu_count() or 1))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("statue", "terrain"):
            mesh = Path(folder) / f"{kind}.ply"
            words = [arguments.command, "generate", kind, "-o", mesh, "--triangles", arguments.triangles, "-q"]
            subprocess.run(words, check=True)
            scene = vl.load(mesh, threads=arguments.threads)
            thing = scene[next(iter(scene))]
            peers: dict[str, Callable[[np.ndarray, np.ndarray], int]] = {
                "python": lambda starts, ways: int(np.isfinite(scene.trace(starts, ways).t).sum()),
                "python occluded": lambda starts, ways: int(scene.occluded(starts, ways).sum()),
            }
            for name, make in (("embreex", embreex), ("open3d", lambda v, f: open3d(v, f, arguments.threads))):
                try:
                    peers[name] = make(thing.vertices, thing.faces)
                except ImportError as error:
                    print(json.dumps({"program": name, "skipped": str(error)}))
            for rays, starts, ways in sets_of_rays(scene):
                found = {"native": native(arguments.command, mesh, starts, ways, arguments.threads)}
                for name, trace in peers.items():
                    found[name] = rate(lambda: trace(starts, ways), len(starts))
                for name, (mrays, hits) in found.items():
                    line = {"mesh": kind, "rays": rays, "program": name, "mrays_per_s": round(mrays, 2), "hits": hits}
                    print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
