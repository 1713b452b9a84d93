"""The bed as an engine has it: grains, contacts, container, overlaps, and the law of a contact."""

from adapters.bed import contact_law
from adapters.bed.contact_law import (
    CHAIN_FACTOR,
    DAMPING_FACTOR,
    OVERLAP_BOUND,
    HertzStiffness,
    collision,
    damping_of_rebound,
    equivalent_modulus,
    normal_force,
    overlap_under_force,
    rayleigh_time,
    restitution_literal,
)
from adapters.bed.container import GOLDEN_ANGLE, Container, Walls, count_sides
from adapters.bed.overlaps import (
    Bed,
    Neighbours,
    bed_measure,
    check_bed,
    find_behind_discs,
    list_wall_rows,
    measure_rows,
    neighbours,
    wall_names,
)
from adapters.bed.radii import (
    RadiusDistribution,
    expect_grain_count,
    find_radius_that_fits,
    sample_radii,
)
from adapters.bed.sample import (
    GRAVITY,
    SURFACE_SHARE,
    draw_sample_start,
    find_sample_mass,
    measure_bed_height,
    measure_sample,
    relative_density,
)
from adapters.bed.state import (
    BoolArray,
    Contacts,
    FloatArray,
    IntArray,
    State,
    load_state,
    make_no_contacts,
    save_state,
)

__all__ = [
    "CHAIN_FACTOR", "DAMPING_FACTOR", "GOLDEN_ANGLE", "GRAVITY", "OVERLAP_BOUND",
    "SURFACE_SHARE", "Bed", "BoolArray", "Contacts",
    "Container", "FloatArray", "HertzStiffness", "IntArray", "Neighbours", "RadiusDistribution",
    "State", "Walls", "bed_measure", "check_bed", "collision", "contact_law", "count_sides",
    "damping_of_rebound", "draw_sample_start", "equivalent_modulus", "expect_grain_count",
    "find_behind_discs", "find_radius_that_fits", "find_sample_mass", "list_wall_rows",
    "load_state", "make_no_contacts", "measure_bed_height", "measure_rows", "measure_sample",
    "neighbours", "normal_force", "overlap_under_force", "rayleigh_time", "relative_density",
    "restitution_literal", "sample_radii", "save_state", "wall_names",
]  # fmt: skip
