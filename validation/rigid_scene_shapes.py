"""What all workers of `rigid_scene_worker` read from a scene; the standard library only."""

from __future__ import annotations

from typing import Any

Data = dict[str, Any]
Path = list[list[list[float]]]
"""Frames of a run: x, y, angle since the start [m, m, rad] and their rates, of every body."""


class NotThere(Exception):
    """The engine has no such shape, law or load; the message says which."""


def pair_friction(a: Data, b: Data) -> float:
    """The smaller of two bodies' coefficients; None leaves it to the other."""
    given = [value for value in (a["friction"], b["friction"]) if value is not None]
    return min(given, default=0.0)


def pairs(scene: Data) -> list[tuple[int, int]]:
    """Pairs of bodies of which one moves at least."""
    bodies = scene["bodies"]
    fixed = [body["fixed"] for body in bodies]
    count = len(bodies)
    return [(i, j) for i in range(count) for j in range(i) if not (fixed[i] and fixed[j])]


def rectangle(vertices: list[list[float]]) -> tuple[float, float] | None:
    """Width and height of a rectangle whose sides lie along the axes; else None."""
    xs, ys = sorted({x for x, _ in vertices}), sorted({y for _, y in vertices})
    if len(vertices) != 4 or len(xs) != 2 or len(ys) != 2:
        return None
    return xs[1] - xs[0], ys[1] - ys[0]


def pair_restitution(a: Data, b: Data) -> float:
    """As `pair_friction`."""
    given = [value for value in (a["restitution"], b["restitution"]) if value is not None]
    return min(given, default=0.0)


def frame_due(k: int, steps: int, every: int) -> bool:
    """Whether a frame is kept after step k = 1, 2, ...: the last one, and each ``every``-th."""
    return k == steps or (every > 0 and k % every == 0)


def text(*numbers: float) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def slab(outline: list[list[float]], depth: float) -> Data:
    """Vertices and outward faces of a slab over an anticlockwise outline (x, z)."""
    count = len(outline)
    vertices = [[x, y, z] for y in (-depth / 2, depth / 2) for x, z in outline]
    near, far = list(range(count)), list(range(2 * count - 1, count - 1, -1))
    sides = [[(k + 1) % count, k, count + k, count + (k + 1) % count] for k in range(count)]
    return {"vertices": vertices, "faces": [near, far, *sides]}
