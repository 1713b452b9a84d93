"""Which pairs may touch."""

from qdem_fem.contact.search import cells
from qdem_fem.contact.search.cells import grow_array
from qdem_fem.contact.search.pairs import (
    NO_IMAGE,
    Pairs,
    choose_skin,
    find_near_walls,
    make_pairs,
    renew_pairs,
)
from qdem_fem.contact.search.periodic import (
    PeriodicWidth,
    check_extents,
    check_joined,
    find_extents,
    find_partners,
)

__all__ = [
    "NO_IMAGE", "Pairs", "PeriodicWidth", "cells", "check_extents", "check_joined", "choose_skin",
    "find_extents", "find_near_walls", "find_partners", "grow_array", "make_pairs", "renew_pairs",
]  # fmt: skip
