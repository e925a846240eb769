"""How far a render is, for people: a bar in a terminal, a picture that grows in a notebook."""

from __future__ import annotations

import base64
import importlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class Progress:
    """How far a render is.

    Attributes:
        samples: taken so far, all pixels together.
        samples_total: that there will be.
        spp: samples that every pixel has.
        elapsed: seconds since rendering began.
        remaining: seconds to the end, as expected; none before anything is known.
    """

    samples: int
    samples_total: int
    spp: int
    elapsed: float
    remaining: float | None

    @property
    def fraction(self) -> float:
        """From 0 to 1."""
        return self.samples / self.samples_total if self.samples_total else 0.0

    def __str__(self) -> str:
        left = "" if self.remaining is None else f", {self.remaining:.0f} s left"
        return f"{100 * self.fraction:3.0f} %, {self.spp} spp, {self.elapsed:.1f} s{left}"


ProgressArgument = bool | Callable[[Progress], object]
"""``False`` for silence, ``True`` for a bar or a notebook's display, or a function that is called now and then."""

Native = Callable[[int, int, int, float, float | None, bytes | None], None]

PREVIEW_SECONDS = 1.0
"""Time between two pictures in a notebook."""


class Listener(Protocol):
    """Someone who follows a render."""

    def native(self) -> tuple[Native, float | None]:
        """What the native half calls, and the time between two pictures."""

    def close(self) -> None:
        """The render has ended."""


class Calls:
    """Calls a function."""

    def __init__(self, call: Callable[[Progress], object]) -> None:
        self._call = call

    def native(self) -> tuple[Native, float | None]:
        def update(
            samples: int, total: int, spp: int, elapsed: float, remaining: float | None, picture: bytes | None
        ) -> None:
            self._call(Progress(samples, total, spp, elapsed, remaining))

        return update, None

    def close(self) -> None:
        """Nothing is left to do."""


class Terminal(Calls):
    """A line on the standard error."""

    WIDTH = 30

    def __init__(self) -> None:
        super().__init__(self._show)
        self._shown = False

    def _show(self, progress: Progress) -> None:
        filled = int(self.WIDTH * progress.fraction)
        bar = "#" * filled + "." * (self.WIDTH - filled)
        print(f"\r[{bar}] {progress}\x1b[K", end="", file=sys.stderr, flush=True)
        self._shown = True

    def close(self) -> None:
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class Notebook:
    """A display that is replaced as the picture grows, and empty in the end: the result shows itself."""

    def __init__(self) -> None:
        shown: Any = importlib.import_module("IPython.display")
        self._html = shown.HTML
        self._handle = shown.display(shown.HTML(""), display_id=True)
        self._picture = ""

    def native(self) -> tuple[Native, float | None]:
        def update(
            samples: int, total: int, spp: int, elapsed: float, remaining: float | None, picture: bytes | None
        ) -> None:
            progress = Progress(samples, total, spp, elapsed, remaining)
            if picture is not None:
                data = base64.b64encode(picture).decode()
                self._picture = f'<br><img src="data:image/png;base64,{data}">'
            bar = f'<progress max="1" value="{progress.fraction:.4f}"></progress> {progress}'
            self._handle.update(self._html(bar + self._picture))

        return update, PREVIEW_SECONDS

    def close(self) -> None:
        self._handle.update(self._html(""))


def in_notebook() -> bool:
    """Whether a notebook shows what is displayed; IPython is not imported to find out."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and "IPKernelApp" in getattr(shell, "config", {})


def listener(progress: ProgressArgument) -> Listener | None:
    """Who follows a render."""
    if callable(progress):
        return Calls(progress)
    if not progress:
        return None
    if in_notebook():
        return Notebook()
    return Terminal() if sys.stderr is not None and sys.stderr.isatty() else None
