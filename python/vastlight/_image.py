"""Finished pictures."""

from __future__ import annotations

import json
import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import UsageError

Format = Literal["png", "exr", "jpg"]
Tonemap = Literal["filmic", "reinhard", "linear", "none"]


class Image:
    """A rendered picture: linear Rec. 709 radiance, auxiliary outputs, figures.

    ``np.asarray(image)`` is its colour, ``(H, W, 3)`` float32, rows from the top. In a notebook it shows itself.
    """

    def __init__(self, native: _native.Image) -> None:
        self._native = native
        self._color: npt.NDArray[np.float32] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, of the crop if there is one."""
        return self._native.size

    @property
    def window(self) -> tuple[int, int, int, int]:
        """``(x0, y0, x1, y1)``: the part of the whole picture that is here; ``x1`` and ``y1`` are not in it."""
        return self._native.window

    @property
    def shape(self) -> tuple[int, int, int]:
        """``(H, W, 3)``."""
        width, height = self.size
        return height, width, 3

    @property
    def planes(self) -> list[str]:
        """Names of all planes as in an EXR file: ``R``, ``normal.X``, ``depth.Z``."""
        return self._native.planes

    @property
    def stats(self) -> dict[str, Any]:
        """What the picture was and what it cost; times in milliseconds. As ``--stats`` of the command line."""
        stats: dict[str, Any] = json.loads(self._native.stats)
        return stats

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if self._color is None:
            self._color = self._native.array(["R", "G", "B"])
            self._color.flags.writeable = False
        if dtype is not None and np.dtype(dtype) != self._color.dtype:
            if copy is False:
                raise ValueError("another type needs a copy")
            return self._color.astype(dtype)
        return self._color.copy() if copy else self._color

    def aov(self, name: str) -> npt.NDArray[np.float32]:
        """An auxiliary output that was asked for with ``aovs=``, float32, rows from the top.

        ``albedo``, ``normal``, ``position``: ``(H, W, 3)``; ``depth``, ``alpha``: ``(H, W)``; ``object``, ``material``: the channels of
        a Cryptomatte, ``(H, W, C)``. Any plane by its name (see :attr:`planes`): ``(H, W)``.
        """
        prefixes = {"object": "CryptoObject", "material": "CryptoMaterial"}
        singles = {"alpha": "A", "depth": "depth.Z"}
        plane = singles.get(name, name)
        if plane in self.planes:
            return self._native.array([plane])[:, :, 0]
        prefix = prefixes.get(name, f"{name}.")
        names = [plane for plane in self.planes if plane.startswith(prefix)]
        if not names:
            there = ", ".join(self.planes)
            raise UsageError(f'the picture has no output "{name}"', "aov", f"render with aovs=[...]; its planes are {there}")
        return self._native.array(names)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        exposure: float = 0.0,
        tonemap: Tonemap = "filmic",
        bit_depth: Literal[8, 16] = 8,
        dither: bool = True,
    ) -> None:
        """Writes ``.exr`` (linear, with all outputs), ``.png`` or ``.jpg`` (tone-mapped sRGB), whole or not at all.

        The bytes are those of the command line for the same request.

        Args:
            path: the file.
            exposure: stops (EV), of PNG and JPEG.
            tonemap: tone curve, of PNG and JPEG.
            bit_depth: bits a channel, of PNG.
            dither: hide the steps of 8-bit gradients.
        """
        self._native.save(os.fspath(path), _tone(exposure, tonemap, bit_depth, dither))

    def encode(
        self,
        format: Format = "png",
        *,
        exposure: float = 0.0,
        tonemap: Tonemap = "filmic",
        bit_depth: Literal[8, 16] = 8,
        dither: bool = True,
    ) -> bytes:
        """The bytes of such a file."""
        return self._native.encode(format, _tone(exposure, tonemap, bit_depth, dither))

    def _repr_png_(self) -> bytes:
        return self.encode("png")

    def __repr__(self) -> str:
        width, height = self.size
        return f"vastlight.Image {width} x {height}, {self.stats['spp_done']} spp"


def _tone(exposure: float, tonemap: str, bit_depth: int, dither: bool) -> dict[str, object]:
    return {"exposure": exposure, "tonemap": tonemap, "bit_depth": bit_depth, "dither": dither}
