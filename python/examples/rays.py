"""Rays as arrays: how much of the sky each point of a mesh sees."""

import os

import numpy as np

import vastlight as vl

try:
    import trimesh

    mesh = trimesh.creation.torus(major_radius=2.0, minor_radius=0.7)
    vertices, faces = mesh.vertices, mesh.faces
except ImportError:
    angles = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    ring, tube = np.meshgrid(angles, angles, indexing="ij")
    radius = 2.0 + 0.7 * np.cos(tube)
    vertices = np.stack([radius * np.cos(ring), radius * np.sin(ring), 0.7 * np.sin(tube)], axis=-1).reshape(-1, 3)
    here = np.arange(64 * 64).reshape(64, 64)
    right, up = np.roll(here, -1, axis=0), np.roll(here, -1, axis=1)
    corner = np.roll(right, -1, axis=1)
    faces = np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in [(here, right, corner), (here, corner, up)]])

scene = vl.Scene()
scene.add_mesh("torus", vertices=vertices, faces=faces)

# A grid of rays from above.
width, height = map(int, os.environ.get("VASTLIGHT_EXAMPLE_SIZE", "256x256").split("x"))
x, y = np.meshgrid(np.linspace(-3, 3, width), np.linspace(-3, 3, height))
origins = np.stack([x, y, np.full_like(x, 5.0)], axis=-1).reshape(-1, 3)
hits = scene.trace(origins, (0.0, 0.0, -1.0))

# From each hit, 64 rays around the normal: what is not occluded is sky.
seen = np.isfinite(hits.t)
points = origins[seen] + hits.t[seen, None] * np.array([0.0, 0.0, -1.0]) + 1e-3 * hits.normal[seen]
random = np.random.default_rng(0).normal(size=(64, len(points), 3))
ways = hits.normal[seen] + random / np.linalg.norm(random, axis=-1, keepdims=True)
occluded = scene.occluded(np.broadcast_to(points, ways.shape).reshape(-1, 3), ways.reshape(-1, 3), tmin=1e-4)
sky = 1.0 - occluded.reshape(64, -1).mean(axis=0)

openness = np.zeros(len(origins), dtype=np.float32)
openness[seen] = sky
np.save("openness.npy", openness.reshape(height, width))
print(f"{seen.sum()} of {len(origins)} rays hit; they see {100 * sky.mean():.1f} % of the sky")
