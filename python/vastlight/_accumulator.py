"""Sums of some passes of a picture, which add up to the bits of one run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

from . import _native
from ._arrays import parse_bytes
from ._errors import UsageError
from ._image import Image


class Accumulator:
    """The sums of some passes of a picture. They can be kept, sent, and added in any order: see :func:`merge`."""

    def __init__(self, native: _native.Accumulator) -> None:
        self._native = native

    @staticmethod
    def from_bytes(data: bytes) -> Accumulator:
        """Reads what :meth:`to_bytes` wrote, on any machine."""
        return Accumulator(_native.Accumulator.from_bytes(data))

    def to_bytes(self) -> bytes:
        """The bytes of a ``.vlc`` file; equal sums are equal bytes."""
        return self._native.to_bytes()

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Accumulator:
        """Reads a ``.vlc`` file, of Python or of the command line."""
        return Accumulator(_native.Accumulator.load(os.fspath(path)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a ``.vlc`` file, whole or not at all."""
        self._native.save(os.fspath(path))

    @property
    def passes(self) -> list[range]:
        """The passes that are in it, counted from 0; a pass is one sample a pixel."""
        return [range(first, end) for first, end in self._native.passes]

    @property
    def recipe(self) -> dict[str, str]:
        """What the sums are sums of. Two can be added if their recipes are equal and they have no pass of a pixel in common."""
        return dict(self._native.recipe)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, of the crop if there is one."""
        return self._native.size

    def develop(self) -> Image:
        """The picture of these passes."""
        return Image(self._native.develop())

    def __reduce__(self) -> tuple[object, ...]:
        return Accumulator.from_bytes, (self.to_bytes(),)

    def __repr__(self) -> str:
        width, height = self.size
        count = sum(len(passes) for passes in self.passes)
        return f"vastlight.Accumulator {width} x {height}, {count} passes"


def merge(
    parts: Iterable[Accumulator] | Sequence[str | os.PathLike[str]], *, memory: int | str | None = None
) -> Accumulator:
    """Adds accumulators, or ``.vlc`` files: the bits of one run, in any order and grouping. Parts of a picture (``crop``) that fill a rectangle
    are put side by side.

    Raises:
        SceneError: two are of different pictures (it says by what), or have passes in common.
    """
    given = list(parts)
    accumulators = [part for part in given if isinstance(part, Accumulator)]
    if len(accumulators) == len(given):
        return Accumulator(_native.Accumulator.merge([part._native for part in accumulators]))
    if accumulators:
        raise UsageError("files and accumulators are mixed", "merge", "load the files first")
    paths = [os.fspath(part) for part in given if not isinstance(part, Accumulator)]
    return Accumulator(_native.Accumulator.merge_files(paths, parse_bytes(memory, "memory")))
