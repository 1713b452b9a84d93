"""One implicit step of the relaxation of section 8: bodies of unit mass on springs and sliders.

Unknown is the move d of the mass-free coordinates, which balances inertia, load and springs,

    d / h = Q + J^T f(xi - J d),    f: `find_spring_forces`

Newton's method on this equation is quick near a solution, but where contacts slide its slope is
not symmetric, and from afar it stalls.  Without friction the equation is the minimum of a convex
energy, which Newton's method with a line search always finds.  With friction it is a friction
problem with a softer W (`ElasticNetwork.find_friction_step`), for which there are solvers that go
on where Newton's method stops; its end is left to Newton's method, for the last digits.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.methods import solve_gauss_seidel, solve_newton
from rigid_lcp.friction.problem import make_problem


@dataclass(frozen=True)
class NetworkNumbers:
    """Newton's steps, sweeps and ends; imbalances are parts of the load."""

    balance: float = 1e-15  # imbalance at which Newton's method ends [-],
    no_descent: float = 1e-11  # and with which it may where it finds no descent [-]
    decrease: float = 1e-4  # part of what a step promises that it has to keep [-]
    halvings: int = 12  # of a step, at most [-],
    energy_halvings: int = 20  # and of one that lowers the energy [-]
    energy_steps: int = 60  # of these, at most [-],
    energy_balance: float = 1e-9  # down to this imbalance [-]
    first_steps: int = 15  # of Newton with friction, before sweeps [-],
    last_steps: int = 10  # after them [-],
    frictionless_steps: int = 5  # and from the least energy [-]
    sweeps: int = 300  # of Gauss-Seidel in a step [-],
    swept: float = 1e-7  # down to this residual [-]
    exact: float = 1e-13  # residual from which on no Newton is needed after them [-]
    polished: float = 1e-14  # down to which that goes [-]
    most_residual: float = 1e-9  # of a friction step that is found [-]


NETWORK = NetworkNumbers()


def find_slider_forces(trial: Floats, allowed: Floats) -> Floats:
    """Forces (nc, dim) [N] of springs with ``trial`` forces (nc, dim) and friction limits (nc,)."""
    force = trial.copy()
    force[:, 0] = np.maximum(trial[:, 0], 0.0)
    size = np.linalg.norm(trial[:, 1:], axis=1)
    force[:, 1:] *= np.divide(allowed, size, out=np.ones_like(size), where=size > allowed)[:, None]
    return force


def find_spring_forces(deformation: Floats, stiffness: Floats, friction: Floats) -> Floats:
    """Eq. 38 with springs: ``f_N = k xi_N`` in compression, ``f_T = k_T xi_T`` up to friction.

    A function of xi alone, as eq. 38 is written: it forgets the path that led there.
    ``deformation`` xi (nc, dim) [m], compression positive, tangents as the force on body a;
    ``stiffness`` (nc, dim) [N/m]; ``friction`` (nc,); the force (nc, dim) [N].
    """
    trial = stiffness * deformation
    return find_slider_forces(trial, friction * np.maximum(trial[:, 0], 0.0))


def find_slider_slope(trial: Floats, stiffness: Floats, friction: Floats) -> Floats:
    """Derivative of `find_spring_forces` by deformation, (nc, dim, dim) [N/m].

    At a kink: the closed, sticking side.  Tangential stiffness is the same both ways.
    """
    count, dim = trial.shape
    closed = trial[:, 0] >= 0
    allowed = friction * np.maximum(trial[:, 0], 0.0)
    size = np.linalg.norm(trial[:, 1:], axis=1)
    slides = size > allowed
    diagonal = stiffness.copy()
    diagonal[~closed, 0] = 0.0
    # a limit of zero can not stick, at zero deformation neither
    diagonal[(allowed <= 0) & ~(closed & (friction > 0)), 1:] = 0
    blocks = np.zeros((count, dim, dim))
    blocks[:, range(dim), range(dim)] = diagonal
    along = trial[slides, 1:] / size[slides, None]
    share = allowed[slides] / size[slides]
    across = np.eye(dim - 1) - along[:, :, None] * along[:, None, :]
    blocks[slides, 1:, 1:] = share[:, None, None] * across * stiffness[slides, None, 1:]
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
        self.force = np.zeros(jacobian.shape[0])
        """Forces of the last `find_friction_step`, where the next begins."""

    @cached_property
    def delassus(self) -> sp.csr_array:
        """W of bodies of unit mass."""
        return sp.csr_array(self.jacobian @ self.jacobian.T)

    @cached_property
    def own_order(self) -> tuple[Ints, Ints]:
        """The contacts in an order that is theirs, not that of the numbers, and its rows of W.

        Gauss-Seidel's way depends on the order; where there are several states so does its end.
        """
        count, dim = self.stiffness.shape
        key = self.delassus @ (self.delassus @ (self.jacobian @ self.free))
        order = np.argsort(key.reshape(count, dim)[:, 0], kind="stable")
        return order, (order[:, None] * dim + np.arange(dim)).ravel()

    def find_imbalance(
        self, deformation: Floats, move: Floats, h: float
    ) -> tuple[Floats, Floats, float]:
        """``d / h - Q - J^T f``, (ndof,), zero for the move d of an implicit step, and its norm.

        First of all the spring forces (nc, dim) after the move, before contacts open or slide.
        """
        moved = deformation - (self.jacobian @ move).reshape(deformation.shape)
        trial = np.asarray(self.stiffness * moved)
        force = find_slider_forces(trial, self.friction * np.maximum(trial[:, 0], 0.0))
        imbalance = np.asarray(move / h - self.free - self.jacobian.T @ force.ravel())
        return trial, imbalance, float(np.linalg.norm(imbalance))

    def find_newton_direction(self, trial: Floats, imbalance: Floats, h: float) -> Floats:
        """``-(1 / h + J^T f' J)^-1`` times the imbalance; f' at ``trial`` forces (nc, dim)."""
        self.newton_steps += 1
        blocks = find_slider_slope(trial, self.stiffness, self.friction)
        count, dim, _ = blocks.shape
        pointer = np.arange(count + 1)
        law = sp.bsr_array((blocks, pointer[:-1], pointer), shape=(count * dim, count * dim))
        slope = self.identity / h + self.jacobian.T @ (law @ self.jacobian)
        return np.asarray(splu(sp.csc_array(slope)).solve(-imbalance))

    def find_coulomb_step(
        self, deformation: Floats, move: Floats, h: float, steps: int
    ) -> tuple[Floats, bool]:
        """Newton's method under Coulomb's law from a first ``move``; move, whether found."""
        trial, imbalance, error = self.find_imbalance(deformation, move, h)
        for _ in range(steps):
            if error <= NETWORK.balance * self.load:
                return move, True
            direction = self.find_newton_direction(trial, imbalance, h)
            for halvings in range(NETWORK.halvings):
                tried = move + direction / 2**halvings
                found = self.find_imbalance(deformation, tried, h)
                if found[2] < (1 - NETWORK.decrease / 2**halvings) * error:
                    break
            else:
                break
            move, (trial, imbalance, error) = tried, found
        # no more descent: round-off, if the balance is as good as it can be
        return move, error <= NETWORK.no_descent * self.load

    def find_friction_step(self, deformation: Floats, h: float) -> tuple[Floats, bool]:
        """The implicit step as a friction problem; move, whether found.

        With forces f for unknowns, ``u = (W + 1 / (k h)) f + J Q - xi / h``: a closed contact has
        no ``u_N``, a sticking one no ``u_T``, and a sliding one slides against f_T.  Springs make W
        regular, and Gauss-Seidel with Newton at its end finds what Newton alone does not.
        """
        soft = self.delassus + sp.diags_array(1.0 / (h * self.stiffness.ravel()))
        offset = self.jacobian @ self.free - deformation.ravel() / h
        order, rows = self.own_order
        problem = make_problem(
            sp.csr_array(sp.csr_array(soft)[rows][:, rows]), offset[rows], self.friction[order],
            deformation.shape[1],
        )  # fmt: skip
        found = solve_gauss_seidel(problem, self.force[rows], NETWORK.swept, NETWORK.sweeps)
        self.newton_steps += NETWORK.sweeps // 100  # the cost of as many sweeps
        if found.residual > NETWORK.exact:
            polished = solve_newton(problem, found.r, NETWORK.polished)
            self.newton_steps += int(polished.work.get("factorisations", 0.0))
            found = min(polished, found, key=lambda each: each.residual)
        if found.residual > NETWORK.most_residual:
            return np.zeros(self.jacobian.shape[1]), False
        self.force[rows] = found.r
        move = h * (self.free + self.jacobian.T @ self.force)
        return self.find_coulomb_step(deformation, move, h, NETWORK.last_steps)

    def find_frictionless_step(self, deformation: Floats, move: Floats, h: float) -> Floats:
        """The move (ndof,) of least energy, from a first ``move``."""

        def find_energy(move: Floats, trial: Floats) -> float:
            springs = float(np.sum(np.maximum(trial[:, 0], 0.0) ** 2 / (2 * self.stiffness[:, 0])))
            return float(move @ move / (2 * h) - self.free @ move + springs)

        trial, imbalance, error = self.find_imbalance(deformation, move, h)
        value = find_energy(move, trial)
        for _ in range(NETWORK.energy_steps):
            if error <= NETWORK.energy_balance * self.load:
                break
            direction = self.find_newton_direction(trial, imbalance, h)
            descent = float(imbalance @ direction)
            for halvings in range(NETWORK.energy_halvings):
                tried = move + direction / 2**halvings
                found = self.find_imbalance(deformation, tried, h)
                value_tried = find_energy(tried, found[0])
                promised = NETWORK.decrease * descent / 2**halvings
                if value_tried <= value + promised + 1e-15 * abs(value):
                    break
            else:
                break
            move, value, (trial, imbalance, error) = tried, value_tried, found
        return move

    def find_implicit_step(self, deformation: Floats, h: float) -> tuple[Floats, bool]:
        """Move d (ndof,) of one implicit step from deformations xi (nc, dim), whether found."""
        move = np.zeros(self.jacobian.shape[1])
        if not self.friction.any():
            move = self.find_frictionless_step(deformation, move, h)
            return self.find_coulomb_step(deformation, move, h, NETWORK.frictionless_steps)
        found, converged = self.find_coulomb_step(deformation, move, h, NETWORK.first_steps)
        return (found, True) if converged else self.find_friction_step(deformation, h)
