"""Whether a bed is borne, and bears its walls and its piston."""

from collections.abc import Iterator
from math import inf, pi, sqrt

import numpy as np

from adapters.bed import OVERLAP_BOUND, State, Walls, find_overlap_under_force, find_pairs
from adapters.errors import UsageError
from adapters.scene.ballast import read_stored_bed
from adapters.scene.mechanics import DOUBTFUL
from adapters.scene.tables import Scene


def judge_bed(state: State, walls: Walls, where: str) -> str:
    """A sentence on grains that float above the floor and the others; empty where none does.

    Raises `UsageError` where most grains touch neither: the ``walls`` do not bear such a bed.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(state.radius)
    mean = float(state.radius.sum()) / max(count, 1)
    rows = find_pairs(state.position, state.radius, walls, DOUBTFUL.gap * mean)
    for share, most in ((OVERLAP_BOUND, count // 2), (DOUBTFUL.gap, 0)):
        near = (rows.second >= -1) & (rows.overlap >= -share * mean)  # -1: the floor, last below
        ends = rows.first[near], np.where(rows.second < 0, count, rows.second)[near]
        joined = coo_array((np.ones(near.sum()), ends), shape=(count + 1, count + 1))
        label = connected_components(joined, directed=False)[1]
        floating = np.flatnonzero(label[:-1] != label[-1])
        if len(floating) > most:
            height = state.position[floating, 2] - state.radius[floating]
            said = (
                f"{len(floating)} of {count} grains rest neither on others nor on the floor: grain "
                f"{state.identifier[floating[height.argmin()]]} is {height.min():.3g} m above it"
            )
            if not most:
                return f"{where}: {said}: look whether they were thrown off; leave them out then"
            remedy = "look whether its floor is at z = 0, radii are no halves, lengths in one unit"
            raise UsageError(f"{said}: nothing bears this bed", where=where, remedy=remedy)
    return ""


def count_layers(scene: Scene) -> float:
    """Layers that the grains make, each on the square that it fills, (2 r)^2 [-]."""
    return scene.grain_count * (2 * scene.sample.radii.mean) ** 2 / scene.container.area


def estimate_swing(scene: Scene) -> float:
    """Frequency sqrt(k/m)/2 pi of the piston on its bed over the load's [-]; inf without a load.

    One contact a grain in each of n layers gives way under the greatest stress sigma: by eq. 5
    k = dF/du = (3/2) sigma A/(n delta).  Beds of scenes that ship show half of this frequency.
    """
    radius, loading, modulus = scene.sample.radii.mean, scene.loading, scene.stiffness.grain
    stress = float(scene.stress_at(np.linspace(0, 1, 101)).max())
    if loading is None or not stress:
        return inf
    force, equivalent = stress * (2 * radius) ** 2, scene.form.usual * radius / 2
    overlap = float(find_overlap_under_force(force, modulus, equivalent))
    stiffness = 1.5 * stress * scene.loaded_area / (max(count_layers(scene), 1.0) * overlap)
    return sqrt(stiffness / loading.piston_mass) * loading.period / (2 * pi)


def warn_of_bed(scene: Scene) -> Iterator[str]:
    """Sentences on what hardly bears; a saved bed that nothing bears may fall, as the rain does."""
    if (path := scene.sample.state) is not None:
        try:
            yield from filter(None, [judge_bed(read_stored_bed(path), scene.walls(inf), path)])
        except UsageError as error:
            yield str(error)
    if (layers := count_layers(scene)) < 1:
        yield f"sample: the grains make {layers:.2g} of a layer: give more; are lengths in metres?"
    give = (scene.stiffness.grain / scene.stiffness.wall / sqrt(2)) ** (2 / 3)  # eq. 5: R* r/2, r
    if give > DOUBTFUL.wall_give:
        yield f"material.wall.young: grains enter walls {give:.3g} times as far as grains: MPa?"
    if (times := estimate_swing(scene)) < DOUBTFUL.own_frequency:
        swings = f"it swings on its bed at most {times:.2g} times as fast as the load"
        yield f"loading.piston_mass: {swings} and misses it: give a lighter one"
