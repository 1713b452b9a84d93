"""Porosity of a bed, without what its walls and its surface add."""

from math import nan, pi, sqrt

import numpy as np

from adapters.bed import Container, FloatArray, measure_bed_height

MIDDLE_LEAST = 2.0
"""Least edge of the box in which the porosity of a bed is measured, in mean diameters."""


def find_middle(
    container: Container, grain: float, height: float
) -> tuple[FloatArray, FloatArray] | None:
    """Corners [m], shape (3,) each, of the box in which the porosity of a bed is measured.

    One ``grain``, a mean diameter [m], inside the floor, the walls, the mirror planes and the
    surface at ``height`` [m]; in a cylinder the box whose corners are so far inside.  None where an
    edge is shorter than `MIDDLE_LEAST`.
    """
    if container.shape == "box":
        low, high = [0.0, 0.0], [container.size_x, container.size_y]
    else:
        half = (container.radius - grain) / sqrt(2) + grain
        low, high = [-half * (axis not in container.symmetry) for axis in "xy"], [half, half]
    corners = np.array([*low, 0.0]) + grain, np.array([*high, height]) - grain
    return corners if min(corners[1] - corners[0]) >= MIDDLE_LEAST * grain else None


def measure_porosity(position: FloatArray, radius: FloatArray, container: Container) -> float:
    """Share of voids in the middle of a bed [-]; nan for a bed too small to have one.

    Of a sphere whose centre is u radii inside a plane the part (2 + 3 u - u^3)/4 is inside.  At an
    edge of `find_middle` the parts of two planes are multiplied, which of spheres that lie anywhere
    with one likelihood is right in the mean: the walls' order and the box's edges add no bias.
    """
    height = measure_bed_height(position, radius)
    middle = find_middle(container, 2 * float(radius.mean()), height)
    if middle is None:
        return nan
    low, high = middle
    inside = np.stack([position - low, high - position]) / radius[:, None]
    u = np.clip(inside, -1, 1)
    part = ((2 + 3 * u - u**3) / 4).prod(axis=(0, 2))
    return 1 - float(4 / 3 * pi * radius**3 @ part / np.prod(high - low))
