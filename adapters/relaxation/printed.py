"""Relaxation by energy: eq. 29 of Karrech et al. (2007) as printed.

    F(u) = sum_pairs psi(delta) - sum_beta F_beta . u_beta - sum_beta m_beta g . u_beta,
    psi  = lambda/(gamma + 1) delta^(gamma + 1),  gamma = 3/2,  lambda = 4/3 E* sqrt(R*).

The signs are those whose minimum balances the forces (the paper prints two plus signs), and a
pair counts once, so that - grad psi is the force of eq. 5 (the printed double sum counts it
twice).  Friction is absent: with gravity a bed that friction holds flows, without it contacts open.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from adapters.bed import BoolArray, FloatArray, Neighbours
from adapters.relaxation.kernel import add_hertz_energy
from adapters.relaxation.smallest import Geometry, Search

Stiffness = Callable[[Neighbours], FloatArray]
"""lambda of each row [N/m^1.5]."""


@dataclass(frozen=True)
class Energy:
    """The functional of a bed: what it adds to the Hertz potential, and its rows nearby."""

    radius: FloatArray
    """Radii [m], (n,)."""
    force: FloatArray
    """Weight and external force of each grain [N], (n, 3)."""
    anchor: FloatArray
    """Estimated centres [m], (n, 3): the zero of work."""
    geometry: Geometry
    search: Search
    stiffness: Stiffness


class EnergyRows:
    """Energy and gradient with a neighbour list that is renewed before it can miss a contact."""

    def __init__(self, energy: Energy, position: FloatArray) -> None:
        self.energy, self.evaluations = energy, 0
        self.skin = 0.2 * float(np.median(energy.radius))
        self._list(position)

    def _list(self, position: FloatArray) -> None:
        self.listed_at = position.copy()
        self.rows = self.energy.search(position, self.skin)
        self.stiffness = self.energy.stiffness(self.rows)

    def __call__(self, position: FloatArray) -> tuple[float, FloatArray]:
        """Energy [J] and its gradient [N], (n, 3), at ``position`` (n, 3) [m]."""
        if np.linalg.norm(position - self.listed_at, axis=1).max(initial=0.0) > self.skin / 2:
            self._list(position)
        self.evaluations += 1
        energy, rows = self.energy, self.rows
        near = energy.geometry(position, rows.first, rows.second)
        gradient = -energy.force
        value = add_hertz_energy(
            near.first, near.second, near.normal, near.overlap, self.stiffness, gradient
        )
        work = np.sum(energy.force * (position - energy.anchor))
        return value - float(work), gradient


def minimise_energy(
    energy: Energy,
    start: FloatArray,
    free: BoolArray,
    length: float,
    force: float,
    evaluations_max: int,
) -> tuple[FloatArray, bool, int, float]:
    """Centres [m] (n, 3) of least energy, whether converged, the evaluations, the energy [J].

    Limited-memory BFGS from ``start`` over the ``free`` grains (n,), in units of ``length`` [m]
    and ``force`` [N]; converged when no component of force on a free grain exceeds ``force``.
    """
    rows = EnergyRows(energy, start)
    position = start.copy()

    def value(moves: FloatArray) -> tuple[float, FloatArray]:
        position[free] = start[free] + length * moves.reshape(-1, 3)
        total, gradient = rows(position)
        return total / (force * length), gradient[free].ravel() / force

    found = minimize(
        value,
        np.zeros(3 * int(free.sum())),
        jac=True,
        method="L-BFGS-B",
        options={
            "maxcor": 20,
            "maxfun": evaluations_max,
            "maxiter": evaluations_max,
            "ftol": 0.0,
            "gtol": 1.0,
        },
    )
    least = value(found.x)[0] * force * length
    return position, bool(np.abs(found.jac).max(initial=0.0) <= 1.0), rows.evaluations, least
