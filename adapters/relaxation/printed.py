"""Relaxation by energy: eq. 29 of Karrech et al. (2007) as printed.

    F(u) = sum_pairs psi(delta) - sum_beta F_beta . u_beta - sum_beta m_beta g . u_beta,
    psi  = lambda/(gamma + 1) delta^(gamma + 1),  gamma = 3/2,  lambda = 4/3 E* sqrt(R*).

The signs are those whose minimum balances the forces (the paper prints two plus signs), and a
pair counts once, so that - grad psi is the force of eq. 5 (the printed double sum counts it
twice).  Friction is absent: with gravity a bed that friction holds flows, without it contacts open.
"""

import numpy as np
from scipy.optimize import minimize

from adapters.bed import GRAVITY, BoolArray, FloatArray
from adapters.relaxation.kernel import add_hertz_energy
from adapters.relaxation.measured import Estimated
from adapters.relaxation.smallest import SMALLEST


class Energy:
    """F and its gradient, with a neighbour list that is renewed before it can miss a contact."""

    def __init__(self, bed: Estimated) -> None:
        self.bed, self.evaluations = bed, 0
        self.weight = np.zeros_like(bed.position)
        self.weight[:, 2] = -GRAVITY * bed.before.mass
        self.skin = SMALLEST.skin * float(np.median(bed.scene.radius))
        self._list(bed.position)

    def _list(self, position: FloatArray) -> None:
        self.listed_at = position.copy()
        self.rows = self.bed.scene.search(position, self.skin)
        self.stiffness = self.bed.scene.row_stiffness(self.rows)

    def __call__(self, position: FloatArray) -> tuple[float, FloatArray]:
        """Energy [J] and its gradient [N], (n, 3), at ``position`` (n, 3) [m]."""
        if np.linalg.norm(position - self.listed_at, axis=1).max() > self.skin / 2:
            self._list(position)
        self.evaluations += 1
        near = self.bed.scene.rows(position, self.rows.first, self.rows.second)
        gradient = -self.weight
        value = add_hertz_energy(
            near.first, near.second, near.normal, near.overlap, self.stiffness, gradient
        )
        work = np.sum(self.weight * (position - self.bed.position))
        return value - float(work), gradient


def minimise_energy(
    bed: Estimated, free: BoolArray, force: float, evaluations_max: int
) -> tuple[FloatArray, bool, int]:
    """Centres [m] (n, 3) of least energy, whether converged, the evaluations.

    Limited-memory BFGS from the estimate over the ``free`` grains (n,), in units of the bed's
    `Estimated.length` and of ``force`` [N]; converged when no component of force on a free grain
    exceeds ``force``.
    """
    energy, start, length = Energy(bed), bed.position, bed.length
    position = start.copy()

    def evaluate(moves: FloatArray) -> tuple[float, FloatArray]:
        position[free] = start[free] + length * moves.reshape(-1, 3)
        total, gradient = energy(position)
        return total / (force * length), gradient[free].ravel() / force

    found = minimize(
        evaluate,
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
    evaluate(found.x)
    return position, bool(np.abs(found.jac).max(initial=0.0) <= 1.0), energy.evaluations
