"""Collisions: impulses, their passing on within a step, restitution."""

from rigid_lcp.collision.impulses import Collision, collide
from rigid_lcp.collision.passing import (
    Closing,
    Impulses,
    find_bouncing,
    find_contact_shift,
    find_hit_by_others,
    find_impulses_in_turn,
)
from rigid_lcp.collision.restitution_scale import Share, gains_energy

__all__ = [
    "Closing", "Collision", "Impulses", "Share", "collide", "find_bouncing",
    "find_contact_shift", "find_hit_by_others", "find_impulses_in_turn", "gains_energy",
]  # fmt: skip
