"""One implicit step of the relaxation of section 8: bodies of unit mass on springs and sliders.

Unknown is the move d of the mass-free coordinates, which balances inertia, load and springs,

    d / h = Q + J^T f(xi - J d),    f: `coulomb_spring`

Two iterations share the work.  Newton's method on this equation is quick near a solution, but its
slope is not symmetric where contacts slide, and from afar it stalls.  With the greatest friction
forces held fixed (Tresca's law) the equation is the minimum of a convex energy, which Newton's
method with a line search always finds; the friction limits are then taken from its normal forces,
and so on, until Newton's method takes over (a fixed point exists by Brouwer's theorem).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

Floats = NDArray[np.float64]


def slider_forces(trial: Floats, allowed: Floats) -> Floats:
    """Forces (nc, dim) [N] of springs with ``trial`` forces (nc, dim) and friction limits (nc,)."""
    force = trial.copy()
    force[:, 0] = np.maximum(trial[:, 0], 0.0)
    size = np.linalg.norm(trial[:, 1:], axis=1)
    force[:, 1:] *= np.divide(allowed, size, out=np.ones_like(size), where=size > allowed)[:, None]
    return force


def slider_energy(trial: Floats, stiffness: Floats, allowed: Floats) -> float:
    """Energy [J] whose derivative by deformation is `slider_forces`, friction limits held fixed."""
    normal = np.maximum(trial[:, 0], 0.0)
    size = np.linalg.norm(trial[:, 1:], axis=1)
    elastic = np.minimum(size, allowed)
    sliding = np.divide(elastic, size, out=np.ones_like(size), where=size > 0)
    # 1/2 f^2 / k of the springs, then work at the constant force of the sliders
    tangential = (trial[:, 1:] ** 2 / stiffness[:, 1:]).sum(axis=1) * sliding * (1 - sliding / 2)
    return float(np.sum(normal**2 / (2 * stiffness[:, 0]) + tangential))


def slider_slope(
    trial: Floats, stiffness: Floats, allowed: Floats, friction: Floats | None = None
) -> Floats:
    """Derivative of `slider_forces` by deformation, (nc, dim, dim) [N/m].

    With ``friction`` (nc,) the limits follow the normal forces (Coulomb), else they are fixed
    (Tresca).  At a kink: the closed, sticking side.  Tangential stiffness is the same both ways.
    """
    count, dim = trial.shape
    closed = trial[:, 0] >= 0
    size = np.linalg.norm(trial[:, 1:], axis=1)
    slides = size > allowed
    diagonal = stiffness.copy()
    diagonal[~closed, 0] = 0.0
    # a limit of zero can not stick, at zero deformation neither
    diagonal[(allowed <= 0) & ~(closed & (friction > 0 if friction is not None else False)), 1:] = 0
    blocks = np.zeros((count, dim, dim))
    blocks[:, range(dim), range(dim)] = diagonal
    along = trial[slides, 1:] / size[slides, None]
    share = allowed[slides] / size[slides]
    across = np.eye(dim - 1) - along[:, :, None] * along[:, None, :]
    blocks[slides, 1:, 1:] = share[:, None, None] * across * stiffness[slides, None, 1:]
    if friction is not None:
        push = np.where(closed, friction * stiffness[:, 0], 0.0)[slides]
        blocks[slides, 1:, 0] = push[:, None] * along
    return blocks


class ElasticNetwork:
    """Bodies of unit mass on springs and sliders.

    ``jacobian`` mass free (nc * dim, ndof); ``free`` (ndof,) accelerations without contact forces;
    ``stiffness`` (nc, dim); ``friction`` (nc,).
    """

    def __init__(
        self, jacobian: sp.csr_array, free: Floats, stiffness: Floats, friction: Floats
    ) -> None:
        self.jacobian, self.free = jacobian, free
        self.stiffness, self.friction = stiffness, friction
        self.identity = sp.eye_array(jacobian.shape[1], format="csc")
        self.load = float(np.linalg.norm(free)) or 1.0
        self.newton_steps = 0

    def trial(self, deformation: Floats, move: Floats) -> Floats:
        """Spring forces (nc, dim) after the move, before contacts open or slide."""
        moved = deformation - (self.jacobian @ move).reshape(deformation.shape)
        return np.asarray(self.stiffness * moved)

    def allowed(self, trial: Floats) -> Floats:
        """Coulomb's friction limits (nc,) of trial forces."""
        return self.friction * np.maximum(trial[:, 0], 0.0)

    def imbalance(self, force: Floats, move: Floats, h: float) -> Floats:
        """``d / h - Q - J^T f``, (ndof,): zero for the move d of an implicit step."""
        return np.asarray(move / h - self.free - self.jacobian.T @ force.ravel())

    def newton_direction(self, blocks: Floats, imbalance: Floats, h: float) -> Floats:
        """``-(1 / h + J^T f' J)^-1`` times the imbalance; ``blocks`` f' (nc, dim, dim)."""
        self.newton_steps += 1
        count, dim, _ = blocks.shape
        pointer = np.arange(count + 1)
        law = sp.bsr_array((blocks, pointer[:-1], pointer), shape=(count * dim, count * dim))
        slope = self.identity / h + self.jacobian.T @ (law @ self.jacobian)
        return np.asarray(splu(sp.csc_array(slope)).solve(-imbalance))

    def coulomb_step(
        self, deformation: Floats, move: Floats, h: float, steps: int
    ) -> tuple[Floats, bool]:
        """Newton's method under Coulomb's law from a first ``move``; move, whether found."""

        def state(move: Floats) -> tuple[Floats, Floats, Floats, float]:
            trial = self.trial(deformation, move)
            allowed = self.allowed(trial)
            imbalance = self.imbalance(slider_forces(trial, allowed), move, h)
            return trial, allowed, imbalance, float(np.linalg.norm(imbalance))

        trial, allowed, imbalance, error = state(move)
        for _ in range(steps):
            if error <= 1e-15 * self.load:
                return move, True
            blocks = slider_slope(trial, self.stiffness, allowed, self.friction)
            direction = self.newton_direction(blocks, imbalance, h)
            for halvings in range(12):
                tried = move + direction / 2**halvings
                found = state(tried)
                if found[3] < (1 - 1e-4 / 2**halvings) * error:
                    break
            else:
                break
            move, (trial, allowed, imbalance, error) = tried, found
        # no more descent: round-off, if the balance is as good as it can be
        return move, error <= 1e-11 * self.load

    def tresca_step(
        self, deformation: Floats, move: Floats, h: float, allowed: Floats
    ) -> tuple[Floats, Floats]:
        """Least energy with friction limits ``allowed`` (nc,); move (ndof,), trial (nc, dim)."""

        def energy(move: Floats) -> tuple[float, Floats]:
            trial = self.trial(deformation, move)
            springs = slider_energy(trial, self.stiffness, allowed)
            return float(move @ move / (2 * h) - self.free @ move + springs), trial

        value, trial = energy(move)
        for _ in range(60):
            imbalance = self.imbalance(slider_forces(trial, allowed), move, h)
            error = float(np.linalg.norm(imbalance))
            if error <= 1e-9 * self.load:
                break
            blocks = slider_slope(trial, self.stiffness, allowed)
            direction = self.newton_direction(blocks, imbalance, h)
            descent = float(imbalance @ direction)
            for halvings in range(20):
                tried = move + direction / 2**halvings
                value_tried, trial_tried = energy(tried)
                if value_tried <= value + 1e-4 * descent / 2**halvings + 1e-15 * abs(value):
                    break
            else:
                break
            move, value, trial = tried, value_tried, trial_tried
        return move, trial

    def implicit_step(
        self, deformation: Floats, h: float, allowed: Floats | None = None
    ) -> tuple[Floats, bool]:
        """Move d (ndof,) of one implicit step from deformations xi (nc, dim), whether found.

        ``allowed`` (nc,): friction limits to begin with; by default all sticks.
        """
        move = np.zeros(self.jacobian.shape[1])
        if not self.friction.any():
            move, _ = self.tresca_step(deformation, move, h, self.friction)
            return self.coulomb_step(deformation, move, h, 5)
        found, converged = self.coulomb_step(deformation, move, h, 15)
        if converged:
            return found, True
        first = allowed is None
        if allowed is None:
            allowed = np.where(self.friction > 0, np.inf, 0.0)
        change, blend, attempt = np.inf, 1.0, 1e-2
        for turn in range(60):
            move, trial = self.tresca_step(deformation, move, h, allowed)
            target, last = self.allowed(trial), change
            if first and turn == 0:
                allowed = target
                continue
            change = float(np.linalg.norm(target - allowed))
            # limits that swing to and fro are averaged
            blend = max(0.3, 0.7 * blend) if change > 0.7 * last else blend
            allowed = allowed + blend * (target - allowed)
            relative = change / (float(np.linalg.norm(allowed)) or 1.0)
            if relative <= attempt:
                attempt = relative / 4.0
                found, converged = self.coulomb_step(deformation, move, h, 15)
                if converged:
                    return found, True
        return move, False
