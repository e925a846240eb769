"""What can go wrong, as exceptions with one clear line: where, what, and a hint."""

from __future__ import annotations


class Error(Exception):
    """Base of all errors of the package.

    Attributes:
        what: what is wrong.
        place: where: a file, an argument, an object's name; may be empty.
        hint: what to do about it; may be empty.
    """

    def __init__(self, what: str, place: str = "", hint: str = "") -> None:
        super().__init__(what, place, hint)
        self.what = what
        self.place = place
        self.hint = hint

    def __str__(self) -> str:
        where = f"{self.place}: " if self.place else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"{where}{self.what}{hint}"


class UsageError(Error, ValueError):
    """The call does not make sense."""


class SceneError(Error, ValueError):
    """A scene, a picture's sums or another input cannot be used."""


class MemoryBudgetError(Error, MemoryError):
    """The work does not fit into the memory budget."""


class DeviceError(Error, RuntimeError):
    """The device, or the denoiser, cannot be used."""


class OutputError(Error):
    """A file cannot be written."""
