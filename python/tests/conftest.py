"""What tests share."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import vastlight as vl


@pytest.fixture
def cornell() -> vl.Scene:
    return vl.load("demo:cornell")


@pytest.fixture
def plane() -> vl.Scene:
    """A square of two triangles at y = 0, from -1 to 1."""
    scene = vl.Scene()
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], dtype=np.float32)
    scene.add_mesh("floor", vertices=corners, faces=[[0, 1, 2], [0, 2, 3]])
    return scene


@pytest.fixture
def command() -> Callable[..., None]:
    """Runs the command line; `VASTLIGHT_COMMAND` says where it is."""
    path = os.environ.get("VASTLIGHT_COMMAND") or shutil.which("vastlight")
    if path is None:
        pytest.skip("the command vastlight: not built (VASTLIGHT_COMMAND)")

    def run(*arguments: str | Path) -> None:
        subprocess.run([path, *map(str, arguments)], check=True)

    return run
