"""The bed as an engine has it: grains, contacts, container, overlaps, and the law of a contact."""

from adapters.bed import contact_law
from adapters.bed.contact_law import (
    CHAIN_FACTOR,
    DAMPING_FACTOR,
    OVERLAP_BOUND,
    HertzStiffness,
    combine_moduli,
    find_literal_restitution,
    find_normal_force,
    find_overlap_under_force,
    find_rayleigh_time,
    find_rebound_damping,
    solve_collision,
)
from adapters.bed.container import GOLDEN_ANGLE, WHOLE, Container, Walls, count_sides
from adapters.bed.overlaps import (
    Bed,
    Neighbours,
    check_bed,
    find_behind_discs,
    find_pairs,
    judge_state,
    list_wall_names,
    list_wall_rows,
    measure_bed,
    measure_rows,
)
from adapters.bed.radii import (
    GradedRadii,
    Radii,
    RadiusDistribution,
    draw_radii,
    expect_grains,
    find_radius_that_fits,
)
from adapters.bed.sample import (
    GRAVITY,
    SURFACE_SHARE,
    draw_sample_start,
    find_sample_mass,
    find_top_under,
    measure_bed_height,
    measure_relative_density,
    measure_sample,
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
    "CHAIN_FACTOR", "DAMPING_FACTOR", "GOLDEN_ANGLE", "GRAVITY", "OVERLAP_BOUND", "SURFACE_SHARE",
    "WHOLE", "Bed", "BoolArray", "Contacts", "Container", "FloatArray", "GradedRadii",
    "HertzStiffness", "IntArray", "Neighbours", "Radii", "RadiusDistribution", "State", "Walls",
    "check_bed", "combine_moduli", "contact_law", "count_sides", "draw_radii", "draw_sample_start",
    "expect_grains", "find_behind_discs", "find_literal_restitution", "find_normal_force",
    "find_overlap_under_force", "find_pairs", "find_radius_that_fits", "find_rayleigh_time",
    "find_rebound_damping", "find_sample_mass", "find_top_under", "judge_state", "list_wall_names",
    "list_wall_rows", "load_state", "make_no_contacts", "measure_bed", "measure_bed_height",
    "measure_relative_density", "measure_rows", "measure_sample", "save_state", "solve_collision",
]  # fmt: skip
