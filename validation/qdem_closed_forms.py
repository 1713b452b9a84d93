"""Closed forms that judge QDEM: cantilever, creep and recovery, thickness mode, waves.

SI units throughout.  The paper is Nishiura, Sakaguchi and Aikawa, Materials 10 (2017) 615.
A closed form is itself an approximation: each says what it neglects, and where not to use it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
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


def euler_bernoulli_tip(load: float, beam: Beam = CONCRETE_BEAM) -> float:
    """Tip displacement P L^3 / 3 E I [m] under an end load P [N] along z, eq. 12.

    Without shear: 0.6 % low for the paper's beam (L/h = 11), so no solution in three dimensions
    converges to it.  Judge by `timoshenko_tip`, or by a second-order solution.
    """
    return load * beam.length**3 / (3 * beam.young * beam.second_moment())


def timoshenko_tip(load: float, beam: Beam = CONCRETE_BEAM) -> float:
    """Tip displacement [m] with shear, P L^3 / 3 E I + P L / kappa G A.

    Neglects that the clamp hinders lateral contraction (0.2 % for the paper's beam).  Not for
    beams shorter than five heights.
    """
    shear = beam.shear_coefficient * beam.shear_modulus * beam.area
    return euler_bernoulli_tip(load, beam) + load * beam.length / shear


def bending_frequency(
    order: int = 1, beam: Beam = CONCRETE_BEAM, plane: str = "z", shear: bool = False
) -> float:
    """Bending frequency [Hz] of the given ``order`` (1, 2, ...), clamped at x = 0.

    Without ``shear`` eq. 13, (beta L)^2 / 2 pi L^2 sqrt(E I / rho A), cos x cosh x = -1 for the
    roots; the paper rounds the first to 1.875.  With ``shear`` Timoshenko's beam, shear and
    rotary inertia, from det T[M V; M V] = 0 with T = exp(A L) and the state (w, psi, M, V).
    Not for orders whose half wave is shorter than five heights.
    """
    bending = beam.young * beam.second_moment(plane)
    root = _bending_root(order)
    slender = root**2 / (2 * math.pi * beam.length**2)
    slender *= math.sqrt(bending / beam.density / beam.area)
    if not shear:
        return slender
    inertia = (beam.second_moment(plane) / beam.area) / beam.length**2
    flexible = bending / (beam.shear_coefficient * beam.shear_modulus * beam.area * beam.length**2)

    def moment_free(scale: float) -> float:
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
    value = [moment_free(scale) for scale in grid]
    crossing = [k for k in range(len(grid) - 1) if value[k] * value[k + 1] < 0][order - 1]
    return slender * float(brentq(moment_free, grid[crossing], grid[crossing + 1], xtol=1e-13))


def _bending_root(order: int) -> float:
    """The root beta L of cos x cosh x = -1 of the given order."""
    middle = (order - 0.5) * math.pi
    return float(brentq(lambda x: math.cos(x) + 1 / math.cosh(x), middle - 0.5, middle + 0.5))


def torsion_frequency(order: int = 1, beam: Beam = CONCRETE_BEAM) -> float:
    """Torsion frequency (2 order - 1)/4L sqrt(G J / rho I_p) [Hz].

    Neglects that the clamp hinders warping, which raises it a little.
    """
    polar = beam.second_moment("y") + beam.second_moment("z")
    stiffness = beam.shear_modulus * beam.torsion_constant
    return (2 * order - 1) / (4 * beam.length) * math.sqrt(stiffness / (beam.density * polar))


def axial_frequency(order: int = 1, beam: Beam = CONCRETE_BEAM) -> float:
    """Axial frequency (2 order - 1)/4L sqrt(E / rho) [Hz]; neglects lateral inertia."""
    return (2 * order - 1) / (4 * beam.length) * bar_speed(beam.young, beam.density)


def cantilever_frequencies(beam: Beam = CONCRETE_BEAM, shear: bool = True) -> dict[str, float]:
    """Six modes [Hz] by name: two bending modes in each plane, the first torsion and axial one."""
    bending = {
        f"bending {plane} {order}": bending_frequency(order, beam, plane, shear)
        for order in (1, 2)
        for plane in ("z", "y")
    }
    return bending | {"torsion 1": torsion_frequency(1, beam), "axial 1": axial_frequency(1, beam)}


# --- creep and recovery, section 3.2 ----------------------------------------------------------


def creep_uniaxial_strain(
    time: ArrayLike,
    stress: float,
    young: float,
    shear_viscosity: float,
    *,
    poisson: float = 0.0,
    bulk_viscosity: float = 0.0,
    unloaded: float = math.inf,
) -> FloatArray:
    """Axial strain at ``time`` [s] under ``stress`` [Pa], the sides held by rollers.

    Only eps_zz is not zero, so sigma = (lam + 2 mu) eps + (lam_D + 2 mu_D) d eps/dt by eq. 7, with
    lam_D + 2 mu_D = bulk viscosity + 4/3 mu_D: the time is **4/3 mu_D / E** at nu = 0 and no bulk
    viscosity, not the mu_D / E of eq. 14.  The load goes at ``unloaded`` [s].  Quasi-static: not
    where inertia counts.
    """
    shear, bulk = _shear_and_bulk(young, poisson)
    modulus, viscosity = bulk + 4 / 3 * shear, bulk_viscosity + 4 / 3 * shear_viscosity
    return stress / modulus * _creep_recovery(time, viscosity / modulus, unloaded)


def creep_uniaxial_stress(
    time: ArrayLike,
    stress: float,
    young: float,
    shear_viscosity: float,
    *,
    poisson: float = 0.0,
    bulk_viscosity: float = 0.0,
    unloaded: float = math.inf,
) -> FloatArray:
    """Axial strain at ``time`` [s] under ``stress`` [Pa], the sides free, the ends slipping.

    Shape and volume creep by themselves, eq. 7 split:
    sigma/3 mu (1 - exp(-t mu/mu_D)) + sigma/9 K (1 - exp(-t K/K_D)).  Without bulk viscosity the
    volume follows at once: at nu = 0 a jump to 1/3, then 2/3 (1 - exp(-t E / 2 mu_D)).
    """
    shear, bulk = _shear_and_bulk(young, poisson)
    shape = _creep_recovery(time, shear_viscosity / shear, unloaded)
    volume = _creep_recovery(time, bulk_viscosity / bulk, unloaded)
    return stress / (3 * shear) * shape + stress / (9 * bulk) * volume


def creep_equation_14(
    time: ArrayLike,
    stress: float,
    young: float,
    viscosity: float,
    unloaded: float = math.inf,
    printed: bool = False,
) -> FloatArray:
    """Strain by eq. 14, the rod of one dimension with axial viscosity mu_D.

    The recovery branch is meant as exp(-t E/mu_D) (exp(+t0 E/mu_D) - 1); ``printed`` gives it with
    the minus sign of the text, which jumps to a negative strain at t0.  Not a judge of QDEM: no
    solid with shear viscosity mu_D and a bulk viscosity of zero or more creeps this fast.
    """
    tau = viscosity / young
    if not printed:
        return stress / young * _creep_recovery(time, tau, unloaded)
    t = np.asarray(time, float)
    recovery = np.exp(-t / tau) * (math.exp(-unloaded / tau) - 1)
    return stress / young * np.where(t <= unloaded, 1 - np.exp(-t / tau), recovery)


def _creep_recovery(time: ArrayLike, tau: float, unloaded: float) -> FloatArray:
    """1 - exp(-t/tau) while loaded, less the same begun at ``unloaded``; a step for tau = 0."""
    t = np.asarray(time, float)

    def creep(since: FloatArray) -> FloatArray:
        started = np.maximum(since, 0.0)
        return -np.expm1(-started / tau) if tau > 0 else np.where(since > 0, 1.0, 0.0)

    return creep(t) - creep(t - unloaded)


def _shear_and_bulk(young: float, poisson: float) -> tuple[float, float]:
    return young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)


# --- damped vibration and waves ---------------------------------------------------------------


def thickness_decay(
    height: float, shear_viscosity: float, density: float, bulk_viscosity: float = 0.0
) -> float:
    """Decay rate [1/s] of the first thickness mode of a slab held at its bottom, rollers aside.

    (bulk viscosity + 4/3 mu_D) k^2 / 2 rho with k = pi / 2 H: 0.01446 mu_D for the slab of
    section 3.2, where the paper measures 0.015 mu_D.  Needs under-damping,
    rate < `thickness_frequency` * 2 pi.
    """
    k = math.pi / 2 / height
    return (bulk_viscosity + 4 / 3 * shear_viscosity) * k**2 / (2 * density)


def thickness_frequency(height: float, young: float, density: float, poisson: float = 0.0) -> float:
    """Frequency c_P / 4H [Hz] of the same mode without damping."""
    return dilatational_speed(young, poisson, density) / (4 * height)


def bar_speed(young: float, density: float) -> float:
    """sqrt(E / rho) [m/s]: long waves in a thin bar; not in a solid wider than its wave length."""
    return math.sqrt(young / density)


def dilatational_speed(young: float, poisson: float, density: float) -> float:
    """c_P = sqrt((lam + 2 mu) / rho) [m/s], plane waves; the fastest signal, so the time step's."""
    shear, bulk = _shear_and_bulk(young, poisson)
    return math.sqrt((bulk + 4 / 3 * shear) / density)


def shear_speed(young: float, poisson: float, density: float) -> float:
    """c_S = sqrt(mu / rho) [m/s]."""
    return math.sqrt(_shear_and_bulk(young, poisson)[0] / density)


def discrete_frequency(
    wavenumber: ArrayLike, speed: float, spacing: float, step: float
) -> FloatArray:
    """omega [rad/s] of a wave on a row of lumped linear elements with central differences.

    sin(omega dt/2) = (c dt/h) sin(k h/2), k [rad/m] ``wavenumber``, h [m] ``spacing``, dt [s]
    ``step``.  In one dimension only: tetrahedra disperse by direction too.
    """
    courant = speed * step / spacing
    half = np.asarray(wavenumber, float) * spacing / 2
    return 2 / step * np.arcsin(courant * np.sin(half))
