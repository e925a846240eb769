"""Renders a demo scene, and writes its colour and its normals."""

import os

import numpy as np

import vastlight as vl

width, height = map(int, os.environ.get("VASTLIGHT_EXAMPLE_SIZE", "640x360").split("x"))

scene = vl.load("demo:still-life")
image = vl.render(scene, size=(width, height), spp=32, aovs=["normal"], progress=True)
image.save("still-life.png")
image.save("still-life.exr")

normal = image.aov("normal")
print(image, "mean radiance", np.asarray(image).mean(), "mean normal", normal.mean(axis=(0, 1)))
