"""A material at several roughnesses, side by side in one array."""

import os

import numpy as np

import vastlight as vl

width, height = map(int, os.environ.get("VASTLIGHT_EXAMPLE_SIZE", "240x240").split("x"))

scene = vl.load("demo:statue", triangles=20_000, sun=(60.0, 40.0))
material = scene.materials["*"]
rows = []
for metal in ("gold", "copper"):
    row = []
    for roughness in (0.1, 0.3, 0.6):
        material.update(metal=metal, roughness=roughness)
        row.append(np.asarray(vl.render(scene, size=(width, height), spp=16)))
    rows.append(np.concatenate(row, axis=1))
sheet = np.concatenate(rows, axis=0)
np.save("sweep.npy", sheet)
print("a sheet of", sheet.shape, "with mean", sheet.mean())
