"""Closed forms that judge QDEM: cantilever, waves.

SI units throughout.  The paper is Nishiura, Sakaguchi and Aikawa, Materials 10 (2017) 615.
A closed form is itself an approximation: each says what it neglects, and where not to use it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

FloatArray = NDArray[np.float64]


# --- cantilever, section 3.1 ------------------------------------------------------------------


@dataclass(frozen=True)
class Beam:
    """A clamped-free prism of rectangular section, the concrete one of section 3.1 by default.

    ``length`` along x, ``width`` along y, ``height`` along z [m]; ``young`` E [Pa], ``poisson``
    nu, ``density`` rho [kg/m^3].
    """

    length: float = 2.4
    width: float = 0.25
    height: float = 0.22
    young: float = 45e9
    poisson: float = 0.167
    density: float = 2350.0

    @property
    def area(self) -> float:
        """alpha_yz, section [m^2]."""
        return self.width * self.height

    @property
    def shear_modulus(self) -> float:
        """G = E / 2(1 + nu) [Pa]."""
        return self.young / 2 / (1 + self.poisson)

    @property
    def shear_coefficient(self) -> float:
        """kappa of Timoshenko's theory: Cowper (1966), rectangle, 10(1+nu)/(12+11 nu)."""
        return 10 * (1 + self.poisson) / (12 + 11 * self.poisson)

    def second_moment(self, plane: str = "z") -> float:
        """I [m^4] for bending in the plane x-z (``z``) or x-y (``y``)."""
        width, height = (self.width, self.height) if plane == "z" else (self.height, self.width)
        return width * height**3 / 12

    @property
    def torsion_constant(self) -> float:
        """J [m^4], Saint-Venant's series for a rectangle (Timoshenko and Goodier, art. 109)."""
        short, long = sorted((self.width, self.height))
        odd = np.arange(1, 41, 2)
        series = float(np.sum(np.tanh(odd * np.pi * long / 2 / short) / odd**5))
        return long * short**3 * (1 / 3 - 64 * short / np.pi**5 / long * series)


CONCRETE_BEAM = Beam()


def find_euler_bernoulli_tip(load: float, beam: Beam = CONCRETE_BEAM) -> float:
    """Tip displacement P L^3 / 3 E I [m] under an end load P [N] along z, eq. 12.

    Without shear: 0.6 % low for the paper's beam (L/h = 11), so no solution in three dimensions
    converges to it.  Judge by `find_timoshenko_tip`, or by a second-order solution.
    """
    return load * beam.length**3 / (3 * beam.young * beam.second_moment())


def find_timoshenko_tip(load: float, beam: Beam = CONCRETE_BEAM) -> float:
    """Tip displacement [m] with shear, P L^3 / 3 E I + P L / kappa G A.

    Neglects that the clamp hinders lateral contraction (0.2 % for the paper's beam).  Not for
    beams shorter than five heights.
    """
    shear = beam.shear_coefficient * beam.shear_modulus * beam.area
    return find_euler_bernoulli_tip(load, beam) + load * beam.length / shear


def find_bending(
    order: int = 1, beam: Beam = CONCRETE_BEAM, plane: str = "z", shear: bool = False
) -> float:
    """Bending frequency [Hz] of the given ``order`` (1, 2, ...), clamped at x = 0.

    Without ``shear`` eq. 13, (beta L)^2 / 2 pi L^2 sqrt(E I / rho A), cos x cosh x = -1 for the
    roots; the paper rounds the first to 1.875.  With ``shear`` Timoshenko's beam, shear and
    rotary inertia, from det T[M V; M V] = 0 with T = exp(A L) and the state (w, psi, M, V).
    Not for orders whose half wave is shorter than five heights.
    """
    bending = beam.young * beam.second_moment(plane)
    root = _find_bending_root(order)
    slender = root**2 / (2 * math.pi * beam.length**2)
    slender *= math.sqrt(bending / beam.density / beam.area)
    if not shear:
        return slender
    inertia = (beam.second_moment(plane) / beam.area) / beam.length**2
    flexible = bending / (beam.shear_coefficient * beam.shear_modulus * beam.area * beam.length**2)

    def find_end_moment(scale: float) -> float:
        omega2 = (scale * root**2) ** 2  # in units of E I / rho A L^4
        slope = np.array(
            [
                [0.0, 1.0, 0.0, flexible],
                [0.0, 0.0, 1.0, 0.0],
                [0.0, -omega2 * inertia, 0.0, -1.0],
                [-omega2, 0.0, 0.0, 0.0],
            ]
        )
        return float(np.linalg.det(expm(slope)[2:, 2:]))

    # shear and rotary inertia only lower a frequency: the roots below the slender one are all
    # those of lower orders and this one, which is the last of them
    grid = np.linspace(0.05 / order**2, 1.0, 40 * order)
    value = [find_end_moment(scale) for scale in grid]
    crossing = [k for k in range(len(grid) - 1) if value[k] * value[k + 1] < 0][order - 1]
    return slender * float(brentq(find_end_moment, grid[crossing], grid[crossing + 1], xtol=1e-13))


def _find_bending_root(order: int) -> float:
    """The root beta L of cos x cosh x = -1 of the given order."""
    middle = (order - 0.5) * math.pi
    return float(brentq(lambda x: math.cos(x) + 1 / math.cosh(x), middle - 0.5, middle + 0.5))


def find_torsion(order: int = 1, beam: Beam = CONCRETE_BEAM) -> float:
    """Torsion frequency (2 order - 1)/4L sqrt(G J / rho I_p) [Hz].

    Neglects that the clamp hinders warping, which raises it a little.
    """
    polar = beam.second_moment("y") + beam.second_moment("z")
    stiffness = beam.shear_modulus * beam.torsion_constant
    return (2 * order - 1) / (4 * beam.length) * math.sqrt(stiffness / (beam.density * polar))


def find_axial(order: int = 1, beam: Beam = CONCRETE_BEAM) -> float:
    """Axial frequency (2 order - 1)/4L sqrt(E / rho) [Hz]; neglects lateral inertia."""
    return (2 * order - 1) / (4 * beam.length) * find_bar_speed(beam.young, beam.density)


def list_beam_frequencies(beam: Beam = CONCRETE_BEAM, shear: bool = True) -> dict[str, float]:
    """Six modes [Hz] by name: two bending modes in each plane, the first torsion and axial one."""
    bending = {
        f"bending {plane} {order}": find_bending(order, beam, plane, shear)
        for order in (1, 2)
        for plane in ("z", "y")
    }
    return bending | {"torsion 1": find_torsion(1, beam), "axial 1": find_axial(1, beam)}


def _find_moduli(young: float, poisson: float) -> tuple[float, float]:
    return young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)


# --- waves ---------------------------------------------------------------


def find_bar_speed(young: float, density: float) -> float:
    """sqrt(E / rho) [m/s]: long waves in a thin bar; not in a solid wider than its wave length."""
    return math.sqrt(young / density)


def find_dilatational_speed(young: float, poisson: float, density: float) -> float:
    """c_P = sqrt((lam + 2 mu) / rho) [m/s], plane waves; the fastest signal, so the time step's."""
    shear, bulk = _find_moduli(young, poisson)
    return math.sqrt((bulk + 4 / 3 * shear) / density)
