"""Ballast in the cribs beside a sleeper's block: its weight on the bed, the same on every engine.

The surcharge q of a footing's bearing capacity, q N_q + (1/2) gamma B N_gamma (Terzaghi 1943), as
one constant force on each grain of the surface.  Strength of that ballast, and its interlock with
the block's sides, are left out.
"""

from pathlib import Path

import numpy as np

from adapters.bed import GRAVITY, FloatArray, State, load_state, measure_sample
from adapters.errors import NotCredible
from adapters.scene import Scene

CELL_SHARE = 0.05
"""Edge of a cell of the surface over the mean radius [-]: a mean grain has 1,256 of them."""


def load_settled(restart: Path) -> State:
    """The bed before its first cycle, of the run with the stage that ``restart`` was saved by."""
    return load_state(restart.parents[1] / "preparation" / "state.npz")


def find_crib_forces(scene: Scene, settled: State) -> FloatArray:
    """Weight of the cribs' ballast on each grain [N], shape (n,); zeros where the scene has none.

    q = phi rho g h, with the relative density phi of the ``settled`` bed, on the section beside
    the block: each grain bears the share that is seen of it from above.
    """
    height = scene.loading.crib if scene.loading else None
    if height is None:
        return np.zeros(len(settled.radius))
    density = measure_sample(settled, scene.container).relative_density
    pressure = density * scene.material.grain.density * GRAVITY * height
    sizes = scene.container.size_x, scene.container.size_y
    seen = count_seen_cells(settled.position, settled.radius, sizes, scene.piston_edges)
    if not seen.any():
        raise NotCredible(
            "no grain is seen from above beside the block", where="loading.crib",
            remedy="more grains (sample.fill_height), a smaller footprint, or no crib",
        )  # fmt: skip
    return pressure * (scene.container.area - scene.loaded_area) * seen / seen.sum()


def count_seen_cells(
    position: FloatArray, radius: FloatArray, sizes: tuple[float, float],
    edges: tuple[float, float, float, float],
) -> FloatArray:  # fmt: skip
    """Cells of a box's section in which each grain is the highest, shape (n,).

    Centres (n, 3) and radii (n,) [m], ``sizes`` of the section [m]; cells between the ``edges`` of
    a block along x, then y [m], are not counted.
    """
    edge = CELL_SHARE * float(radius.mean())
    lines = [(np.arange(n) + 0.5) * size / n for size in sizes for n in [int(np.ceil(size / edge))]]
    top, highest = np.full((2, len(lines[0]), len(lines[1])), -np.inf)
    for grain, (centre, r) in enumerate(zip(position, radius, strict=True)):
        part = tuple(
            slice(*np.searchsorted(line, [c - r, c + r]))
            for line, c in zip(lines, centre[:2], strict=True)
        )
        x, y = (line[cut] - c for line, cut, c in zip(lines, part, centre[:2], strict=True))
        height = centre[2] + np.sqrt(np.maximum(r**2 - x[:, None] ** 2 - y**2, 0.0))
        seen = (x[:, None] ** 2 + y**2 < r**2) & (height > top[part])
        top[part][seen], highest[part][seen] = height[seen], grain
    x, y = lines
    under = ((edges[0] < x) & (x < edges[1]))[:, None] & (edges[2] < y) & (y < edges[3])
    found = highest[~under & np.isfinite(highest)].astype(np.int64)
    return np.bincount(found, minlength=len(radius)).astype(float)
