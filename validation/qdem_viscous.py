"""Viscosity of QDEM judged by closed forms (section 3.2); the paper's ends are in `qdem_slab`.

The slab is 0.22 m high and loaded on top; nu = 0 and no bulk viscosity, so lam_D = -2/3 mu_D.

Damped vibration: the first thickness mode decays at (4/3) k^2 mu_D/(2 rho) = 0.01446 mu_D with
k = pi/2H; the paper measures 0.015 mu_D and had nothing to compare it with.

Creep: eq. 14 assumes a rod of one dimension of axial viscosity mu_D.  No solid is that: in
uniaxial strain the axial viscosity is lam_D + 2 mu_D = 4/3 mu_D, in uniaxial stress the volume
jumps to a third of the strain at once and the shape follows with 2 mu_D/E.  The branch of recovery
is printed with the wrong sign: it must be exp(-t E/mu_D) (exp(+t0 E/mu_D) - 1).

Inertia: it shifts the creep by about (1/omega tau)^2 of the strain, with omega = pi c/2H = 104 1/s
of the 0.5 MPa slab.  mu_D = 2e5 Pa s makes omega tau = 55 and the shift 0.03 %.  In uniaxial stress
the volume is not damped and would ring after a jump of the load, so the load comes and goes by a
smooth step, and the closed form is convolved with it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from qdem_fem import Body, Material, Series, Simulation
from qdem_fem.mesh_generation import box_mesh
from qdem_fem.spectra import peak_frequencies
from validation.case import Check
from validation.qdem_closed_forms import (
    creep_equation_14,
    creep_uniaxial_strain,
    creep_uniaxial_stress,
    thickness_decay,
    thickness_frequency,
)
from validation.qdem_judge import FloatArray
from validation.qdem_problem import below, reported, smooth_step
from validation.qdem_record import Outcome, Table

HEIGHT = 0.22
DENSITY = 2350.0
YOUNG_SOFT = 0.5e6
"""Of the quasi-static tests of the paper [Pa]."""
VISCOSITY_SOFT = 2e5
"""mu_D of the creep tests [Pa s], see above."""
STRESS = 10 / (2.4 * 0.25)
"""10 N on the top of the slab [Pa]."""
RISE = 0.2
"""Duration of the smooth steps of the load [s]."""
UNLOADED, END = 2.0, 3.5
"""[s]"""
SAMPLING = 0.02
"""Of the creep [s]."""


# --- damped vibration -------------------------------------------------------------------------


def thickness_run(viscosity: float, layers: int) -> tuple[float, float]:
    """Decay rate [1/s] and frequency [Hz] of the first thickness mode, sides on rollers."""
    mesh = box_mesh((0.11, 0.11, HEIGHT), (2, 2, layers))
    body = Body(mesh, Material(45e9, 0.0, DENSITY, shear_viscosity=viscosity))
    run = Simulation([body], threads=1)
    hold_uniaxial(run, body)
    z = mesh.nodes[:, 2]
    field = np.zeros_like(mesh.nodes)
    field[:, 2] = 1e-9 * np.sin(np.pi / 2 / HEIGHT * z)
    body.displacement = field
    period = 1 / thickness_frequency(HEIGHT, 45e9, DENSITY)
    history = run.advance(8 * period, {"top": mesh.node_sets["z-max"]}, period / 40)
    mode = peak_frequencies(history.time, history["top"][:, 2], count=1)[0]
    return mode.decay, mode.frequency


def hold_uniaxial(run: Simulation, body: Body) -> None:
    """The bottom and the four sides on rollers: uniaxial strain."""
    sets = body.mesh.node_sets
    run.fix(body, sets["z-min"], "z")
    for axis in "xy":
        run.fix(body, np.union1d(sets[f"{axis}-min"], sets[f"{axis}-max"]), axis)


def decay_checks(layers: int) -> list[Check]:
    """Decay over a decade of viscosities, within 1 %."""
    rows = []
    for viscosity in (1e4, 3e4, 1e5):
        decay, frequency = thickness_run(viscosity, layers)
        closed = thickness_decay(HEIGHT, viscosity, DENSITY)
        omega = 2 * np.pi * thickness_frequency(HEIGHT, 45e9, DENSITY)
        damped = np.sqrt(omega**2 - closed**2) / (2 * np.pi)
        rows += [
            below(f"thickness mode, {viscosity:g} Pa s: decay to closed form",
                  abs(decay / closed - 1), 1e-2),
            reported(f"thickness mode, {viscosity:g} Pa s: decay over mu_D", decay / viscosity),
            below(f"thickness mode, {viscosity:g} Pa s: frequency to closed form",
                  abs(frequency / damped - 1), 1e-2),
        ]  # fmt: skip
    return rows


# --- creep and recovery -----------------------------------------------------------------------


def load_history() -> Series:
    """Share of the load in time: smoothly on, and off again."""
    return smooth_step(RISE, back=UNLOADED)


def convolved(creep: Callable[..., FloatArray], time: FloatArray) -> FloatArray:
    """Answer to `load_history` at times (k,) [s] from that to a jump (Boltzmann's superposition).

    ``creep(t, stress, young, viscosity)`` is a closed form of `qdem_closed_forms`.
    """
    load = load_history()
    middle = 0.5 * (load.times[1:] + load.times[:-1])
    since = time[:, None] - middle
    answer = creep(np.maximum(since, 0.0), STRESS, YOUNG_SOFT, VISCOSITY_SOFT)
    return np.asarray((np.where(since > 0, answer, 0.0) * np.diff(load.values)).sum(axis=1))


def creep_run(free_sides: bool) -> tuple[FloatArray, FloatArray]:
    """Times [s] and axial strain [-] of a column under the load of `load_history`."""
    mesh = box_mesh((0.11, 0.11, HEIGHT), (2, 2, 4))
    body = Body(mesh, Material(YOUNG_SOFT, 0.0, DENSITY, shear_viscosity=VISCOSITY_SOFT))
    run = Simulation([body], threads=1)
    sets = mesh.node_sets
    if free_sides:  # one quarter of a column: three planes of symmetry
        for axis in "xyz":
            run.fix(body, sets[f"{axis}-min"], axis)
    else:
        hold_uniaxial(run, body)
    load = load_history()
    run.pressure(body, sets["z-max"], Series(load.times, STRESS * load.values))
    history = run.advance(END, {"top": sets["z-max"]}, SAMPLING)
    return history.time, -history["top"][:, 2] / HEIGHT


def creep_checks() -> tuple[list[Check], dict[str, Table]]:
    """Both closed forms within 0.5 % of the strain at the end of the load's rest."""
    rows = []
    tables: dict[str, Table] = {}
    for name, free_sides, closed in (
        ("uniaxial strain", False, creep_uniaxial_strain),
        ("uniaxial stress", True, creep_uniaxial_stress),
    ):
        time, strain = creep_run(free_sides)
        expected = convolved(closed, time)
        off = np.abs(strain - expected) / expected.max()
        loaded = time < UNLOADED
        rows += [
            below(f"creep, {name}, to closed form", 100 * off[loaded].max(), 0.5, "%"),
            below(f"recovery, {name}, to closed form", 100 * off[~loaded].max(), 0.5, "%"),
        ]
        assumed = convolved(creep_equation_14, time)
        apart = np.abs(strain - assumed).max() / expected.max()
        rows.append(reported(f"creep, {name}, to eq. 14", 100 * apart, "%"))
        scale = YOUNG_SOFT / STRESS
        tables[f"creep-{name.replace(' ', '-')}"] = {
            "time [s]": time,
            "QDEM": scale * strain,
            "closed form": scale * expected,
            "eq. 14": scale * assumed,
        }
    return rows, tables


# --- the forms --------------------------------------------------------------------------------


def quick_checks() -> list[Check]:
    """16 layers."""
    return [*decay_checks(16), *creep_checks()[0]]


def full() -> Outcome:
    """32 layers."""
    checks, tables = creep_checks()
    return Outcome([*decay_checks(32), *checks], tables)
