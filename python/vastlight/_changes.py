"""Looks of a scene by name: materials, lights, environment."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Generic, TypeVar

from . import _native


def to_json(changes: Mapping[str, Any]) -> str:
    """Changes as JSON; arrays and numbers of NumPy, and paths, may be in them."""

    def plain(value: Any) -> Any:
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        if hasattr(value, "tolist"):
            return value.tolist()
        raise TypeError(f"{type(value).__name__} is no value of a look")

    return json.dumps(changes, default=plain)


class Looks:
    """All changes of a scene's looks since it was opened."""

    def __init__(self, native: _native.Scene) -> None:
        self.native = native
        self.changes: dict[str, Any] = {}

    def change(self, path: Sequence[str], values: Mapping[str, Any], instead_of: Sequence[str] = ()) -> None:
        """Adds changes of an entry, and drops those that they stand for, or leaves all as it was if they are wrong."""
        added: dict[str, Any] = json.loads(to_json(values))
        changes: dict[str, Any] = json.loads(to_json(self.changes))
        entry = changes
        for name in path:
            entry = entry.setdefault(name, {})
        for key in instead_of:
            entry.pop(key, None)
        entry.update(added)
        self.native.revise(to_json(changes))
        self.changes = changes

    def forget(self, path: Sequence[str]) -> None:
        """Drops the changes of an entry, if there are any."""
        if not self.of(path):
            return
        changes: dict[str, Any] = json.loads(to_json(self.changes))
        entry = changes
        for name in path[:-1]:
            entry = entry[name]
        del entry[path[-1]]
        self.native.revise(to_json(changes))
        self.changes = changes

    def of(self, path: Sequence[str]) -> dict[str, Any]:
        """Changes of an entry."""
        entry = self.changes
        for name in path:
            entry = entry.get(name, {})
        return entry


class Entry:
    """Something whose looks can be changed: attributes are keys."""

    _kind = ""
    # What keys mean that were not set, where it is not to be seen in the entry itself.
    _unset: Mapping[str, Any] = {}

    def __init__(self, looks: Looks, name: str) -> None:
        object.__setattr__(self, "_looks", looks)
        object.__setattr__(self, "name", name)

    _looks: Looks
    name: str

    def _path(self) -> list[str]:
        return [self._kind, self.name]

    def update(self, **values: Any) -> None:
        """Changes several keys at once, or none if one of them is wrong."""
        self._looks.change(self._path(), values)

    def values(self) -> dict[str, Any]:
        """Everything that is known of it, as it is now."""
        text = self._looks.native.entry(self._kind, self.name)
        found: dict[str, Any] = json.loads(text) if text is not None else {}
        return {key: _factor(value) for key, value in found.items()}

    def __setattr__(self, key: str, value: Any) -> None:
        self.update(**{key: value})

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        changed = self._looks.of(self._path())
        if key in changed:
            return changed[key]
        values = self.values()
        if key in values:
            return values[key]
        if key in self._unset:
            return self._unset[key]
        raise AttributeError(f"{type(self).__name__} {self.name!r} has no {key!r}; there are {', '.join(sorted({*values, *self._unset}))}")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.values(), *self._unset})

    def __repr__(self) -> str:
        return f"vastlight.{type(self).__name__} {self.name!r}"


def _factor(value: Any) -> Any:
    """The number or the colour of an input that may have a texture."""
    return value["factor"] if isinstance(value, dict) and "factor" in value else value


class Material(Entry):
    """A material: glTF's metallic-roughness model with its extensions. A number that is set replaces the texture of its input.

    Keys: ``base_color``, ``alpha``, ``metal``, ``metallic``, ``roughness``, ``emission`` (W/(sr m^2)), ``ior``, ``specular``,
    ``specular_color``, ``transmission``, ``thickness``, ``attenuation_color``, ``attenuation_distance``, ``dispersion``, ``clearcoat``,
    ``clearcoat_roughness``, ``sheen_color``, ``sheen_roughness``, ``anisotropy``, ``iridescence``, ``double_sided``, ``normal_map``.
    """

    _kind = "materials"
    _unset = {"metal": None}


class Light(Entry):
    """A light without surface. Keys: ``intensity`` (W/sr, or W/m^2 of a directional light), ``scale``, ``ies`` (a file)."""

    _kind = "lights"
    _unset = {"scale": 1.0, "ies": None}


class Environment(Entry):
    """Light from infinity. Keys: one of ``map`` (a file), ``color``, ``sun`` (azimuth and elevation in degrees); ``turbidity``,
    ``strength``, ``rotation`` (degrees). What was not set here reads as nothing, 1 or 0."""

    _kind = "environment"
    _KINDS = ("map", "color", "sun")
    _unset = {"map": None, "color": None, "sun": None, "turbidity": None, "strength": 1.0, "rotation": 0.0}

    def __init__(self, looks: Looks) -> None:
        super().__init__(looks, "environment")

    def _path(self) -> list[str]:
        return [self._kind]

    def update(self, **values: Any) -> None:
        """Changes several keys at once; a new kind of light takes the place of the one before."""
        is_replaced = any(kind in values for kind in self._KINDS)
        self._looks.change(self._path(), values, self._KINDS if is_replaced else ())


E_ = TypeVar("E_", bound=Entry)


class Table(Mapping[str, E_], Generic[E_]):
    """Materials or lights by name; ``"*"`` stands for all."""

    def __init__(
        self,
        looks: Looks,
        kind: str,
        make: Callable[[Looks, str], E_],
        missing: Callable[[str, str, Sequence[str]], Exception],
    ) -> None:
        self._looks, self._kind, self._make, self._missing = looks, kind, make, missing

    def _names(self) -> list[str]:
        return self._looks.native.table(self._kind)

    def __getitem__(self, name: str) -> E_:
        if name != "*" and name not in self:
            raise self._missing(self._kind.removesuffix("s"), name, self._names())
        return self._make(self._looks, name)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._looks.native.has(self._kind, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def __repr__(self) -> str:
        return f"vastlight.{self._kind} {self._names()}"
