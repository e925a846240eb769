"""The examples run, at a small size."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "VASTLIGHT_EXAMPLE_SIZE": "32x24"}
    subprocess.run([sys.executable, str(example)], cwd=tmp_path, env=environment, check=True)
    assert any(tmp_path.iterdir()), "it writes something"
