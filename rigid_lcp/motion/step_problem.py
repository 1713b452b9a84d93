"""The friction problem of a time step by its parts: to look at, to share, to solve elsewhere."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.collision import find_bouncing, find_contact_shift
from rigid_lcp.contact import Contacts
from rigid_lcp.friction.files import write_problem
from rigid_lcp.friction.problem import FrictionProblem, make_problem
from rigid_lcp.motion.equations import find_contact_offset, make_body_space
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.time_stepping import begin_step, find_closing_contacts
from rigid_lcp.motion.world import World


@dataclass(frozen=True, kw_only=True)
class StepProblem(FrictionProblem):
    """``u = W r + q`` of a step's impulses, and ``a = A f + b`` of forces at its midpoint.

    Rows go contact after contact, (n, t) or (n, t1, t2); ``friction`` (nc,) [-]; ``bodies`` J and
    M^-1.  ``residual(r)`` judges any solver's impulses.
    """

    b: Floats
    """Relative accelerations without contact forces, (nc * dim,) [m/s^2] (eqs 17, 24)."""
    geometry: Contacts  # the contacts, those near enough to close within the step too
    h: float  # length of the step [s]

    @property
    def A(self) -> sp.csr_array:
        """``J M^-1 J^T`` (nc * dim, nc * dim) [1/kg] (eqs 17, 25); ``A[::dim, ::dim]`` is A^NN."""
        return self.delassus

    @property
    def W(self) -> sp.csr_array:
        """The same matrix: relative velocities by impulses, as A is accelerations by forces."""
        return self.delassus

    @property
    def q(self) -> Floats:
        """Relative velocities that the step ends with without impulses, restitution and what a gap
        leaves subtracted, (nc * dim,) [m/s]."""
        return self.offset

    def accelerate(self, force: ArrayLike) -> Floats:
        """``a = A f + b`` (eqs 18, 23, 26), (nc * dim,) [m/s^2], of contact forces f [N]."""
        return np.asarray(self.delassus @ np.asarray(force, dtype=float).ravel() + self.b)

    def save(self, path: Path | str) -> list[Path]:
        """Write it to ``path``, NAME.npz, as `write_problem` does, with b and h; the files."""
        return write_problem(path, self, b=self.b, h=np.array(self.h))


def make_step_problem(
    world: World, motion: Motion, loads: ArrayLike | None, h: float
) -> StepProblem:
    """The problem of a step of length ``h`` [s] as `step_moreau` first poses it: with restitution
    undiminished, and without what bodies that are struck strike in turn.

    ``loads`` (n, 3) or (n, 6) [N, N m] at the midpoint, or None.
    """
    middle, free, _, contacts = begin_step(world, motion, loads, h)
    bodies = make_body_space(contacts, middle.position, world.columns, world.inverse_mass(middle))
    closing = find_closing_contacts(world, contacts, middle, free, h)
    offset = closing.offset + find_contact_shift(closing, find_bouncing(closing))
    made = make_problem(bodies, offset, contacts.friction, motion.dim)
    falling = replace_rates(middle, world.accelerations(middle, loads))
    return StepProblem(
        **vars(made), b=find_contact_offset(contacts, middle, falling), geometry=contacts, h=h
    )
