"""Array-likes as the contiguous arrays that the native half takes: views where nothing must change."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import SceneError, UsageError


def as_array(values: Any, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """A C-contiguous array of a type; the very memory of `values` where that is one already."""
    if not isinstance(values, np.ndarray) and not hasattr(values, "__array__") and hasattr(values, "__dlpack__"):
        values = np.from_dlpack(values)
    return np.ascontiguousarray(values, dtype=dtype)


def as_rows(values: Any, columns: int, name: str, dtype: npt.DTypeLike = np.float32) -> npt.NDArray[Any]:
    """(N, columns); a single row may come without its axis."""
    array = as_array(values, dtype)
    if array.ndim == 1 and array.shape[0] == columns:
        array = array.reshape(1, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        raise UsageError(f"the shape is {array.shape}, not (N, {columns})", name)
    return array


def as_faces(values: Any) -> npt.NDArray[np.uint32]:
    """(M, 3) uint32, of any type of integers that are not negative."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu":
        raise UsageError(f"indices of vertices are integers, not {array.dtype}", "faces")
    if array.size and (int(array.min()) < 0 or int(array.max()) > 0xFFFF_FFFF):
        raise UsageError("indices of vertices are 0 to 4294967295", "faces")
    return as_rows(array, 3, "faces", np.uint32)


def as_matrix(values: Any) -> npt.NDArray[np.float64]:
    """(4, 4) float64."""
    array = as_array(values, np.float64)
    if array.shape != (4, 4):
        raise UsageError(f"the shape is {array.shape}, not (4, 4)", "transform")
    return array


def parse_bytes(size: int | str | None, name: str) -> int | None:
    """Bytes from a number, or text such as ``"8GiB"``, ``"512MiB"``, ``"2G"``: binary units. `name` is the argument."""
    if size is None:
        return None
    if isinstance(size, str):
        return _native.parse_bytes(size, name)
    try:
        count = operator.index(size)
    except TypeError:
        count = -1
    if not 0 <= count < 1 << 64:
        raise UsageError(f"{size!r} is no size", name, "write 8GiB, 512MiB or a number of bytes")
    return count


def as_number(number: int) -> int:
    """The number of an instance."""
    index = operator.index(number)
    if not 0 <= index < 1 << 31:
        raise SceneError(f"instance {index} does not exist", "scene")
    return index
