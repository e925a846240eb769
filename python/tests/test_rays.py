"""Arrays of rays."""

from __future__ import annotations

import numpy as np
import pytest

import vastlight as vl


def rays(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    origins = random.uniform(-3, 3, (count, 3)).astype(np.float32)
    return origins, (random.uniform(-1, 1, (count, 3)) - origins).astype(np.float32)


def brute_force(vertices: np.ndarray, faces: np.ndarray, origins: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Distances by Moeller and Trumbore, in float64."""
    a, b, c = (vertices[faces[:, i]].astype(np.float64) for i in range(3))
    best = np.full(len(origins), np.inf)
    for i, (o, d) in enumerate(zip(origins.astype(np.float64), ways.astype(np.float64), strict=True)):
        p = np.cross(d, c - a)
        det = np.einsum("ij,ij->i", b - a, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", o - a, p) / det
            q = np.cross(o - a, b - a)
            v = (q @ d) / det
            t = np.einsum("ij,ij->i", c - a, q) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
        best[i] = t[hit].min() if hit.any() else np.inf
    return best


def test_rows_stay_rows(plane: vl.Scene) -> None:
    hits = plane.trace([[0, 2, 0], [9, 2, 0], [0.5, -1, 0.25]], [[0, -4, 0], [0, -1, 0], [0, 1, 0]])
    assert hits.t.tolist() == [0.5, np.inf, 1.0]
    assert hits.t.dtype == np.float32 and hits.prim.dtype == hits.instance.dtype == np.int32
    assert hits.instance.tolist() == [0, -1, 0] and hits.prim[1] == -1 and hits.prim[0] in (0, 1)
    assert hits.uv.shape == (3, 2) and hits.uv[1].tolist() == [0, 0]
    assert hits.normal.tolist() == [[0, 1, 0], [0, 0, 0], [0, 1, 0]]
    t, prim, *_ = hits
    assert t is hits.t and prim is hits.prim


def test_hits_are_where_they_say() -> None:
    scene = vl.load("demo:statue", triangles=20_000)
    name = next(iter(scene))
    statue = scene[name]
    center = scene.bounds.mean(axis=0)  # type: ignore[union-attr]
    origins, ways = rays(200)
    origins, ways = origins + center, ways
    hits = scene.trace(origins, ways)
    place = statue.transform.astype(np.float32)
    vertices = statue.vertices @ place[:3, :3].T + place[:3, 3]
    expected = brute_force(vertices, statue.faces, origins, ways)
    mine = np.where((hits.instance == statue.instances[0]) | ~np.isfinite(hits.t), hits.t, np.nan)
    known = ~np.isnan(mine)
    assert known.sum() > 60
    agree = np.isclose(mine[known], expected[known], rtol=1e-4, atol=1e-5) | (mine[known] == expected[known])
    assert agree.mean() > 0.99
    row = np.flatnonzero(np.isfinite(mine))[0]
    a, b, c = vertices[statue.faces[hits.prim[row]]]
    u, v = hits.uv[row]
    assert np.allclose(a + u * (b - a) + v * (c - a), origins[row] + hits.t[row] * ways[row], atol=1e-3)
    normal = np.cross(b - a, c - a)
    assert np.allclose(hits.normal[row], normal / np.linalg.norm(normal), atol=1e-3)


def test_any_array_will_do(cornell: vl.Scene) -> None:
    origins, ways = rays(5000)
    expected = cornell.trace(origins, ways)
    assert np.isfinite(expected.t).any()
    wide = np.zeros((5000, 7), np.float64)
    wide[:, 2:5] = origins
    read_only = ways.copy()
    read_only.flags.writeable = False
    for o, d in [
        (wide[:, 2:5], ways),
        (np.asfortranarray(origins), ways.tolist()),
        (origins[::-1][::-1], read_only),
    ]:
        found = cornell.trace(o, d)
        assert all(np.array_equal(mine, theirs) for mine, theirs in zip(found, expected, strict=True))

    class Tensor:
        """Knows DLPack alone."""

        def __dlpack__(self, **options: object) -> object:
            return origins.__dlpack__(**options)  # type: ignore[arg-type]

        def __dlpack_device__(self) -> tuple[int, int]:
            return origins.__dlpack_device__()

    assert np.array_equal(cornell.trace(Tensor(), ways).t, expected.t)  # type: ignore[arg-type]


def test_bounds_cut_rays(plane: vl.Scene) -> None:
    origins, ways = [[0, 2, 0]] * 3, [0, -1, 0]
    assert plane.trace(origins, ways, tmax=[1, 2.5, np.inf]).t.tolist() == [np.inf, 2, 2]
    assert plane.trace(origins, ways, tmin=[0, 2.5, 1]).t.tolist() == [2, np.inf, 2]
    assert plane.occluded(origins, ways, 0, [1.9, 2.1, 3]).tolist() == [False, True, True]
    assert plane.trace([0, 2, 0], [[0, -1, 0], [0, 1, 0]]).t.tolist() == [2, np.inf]
    assert plane.trace(np.zeros((0, 3)), np.zeros((0, 3))).normal.shape == (0, 3)
    odd = plane.trace([[np.nan, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 0]])
    assert not np.isfinite(odd.t).any()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((np.zeros((4, 2)), np.zeros((4, 3))), "origins"),
        ((np.zeros((4, 3)), np.zeros((5, 3))), "5 directions for 4"),
        ((np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(3)), "tmin"),
        ((np.zeros((4, 3)), np.zeros((4, 3)), 0.0, np.zeros((4, 1))), "tmax"),
        ((np.zeros((2, 2, 3)), np.zeros((4, 3))), "origins"),
    ],
)
def test_shapes_are_checked(plane: vl.Scene, arguments: tuple[object, ...], expected: str) -> None:
    with pytest.raises(vl.UsageError, match=expected):
        plane.trace(*arguments)  # type: ignore[arg-type]


def test_many_rays_are_the_same_on_any_threads() -> None:
    origins, ways = rays(60_000)
    one, two = (vl.load("demo:cornell", threads=threads) for threads in (1, 2))
    first, second = one.trace(origins, ways), two.trace(origins, ways)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    assert np.array_equal(one.occluded(origins, ways), np.isfinite(first.t))


def test_surfaces_without_triangles_have_no_triangle() -> None:
    scene = vl.load("demo:metaballs")
    center = scene.bounds.mean(axis=0)  # type: ignore[union-attr]
    origins, ways = rays(2000)
    hits = scene.trace(origins + center, ways)
    bare = np.isfinite(hits.t) & (hits.prim < 0)
    assert bare.any() and (hits.instance[bare] >= 0).all() and (hits.normal[bare] == 0).all()
