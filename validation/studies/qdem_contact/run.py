"""The parts: cubes pressed, Hertz, hard cases, a packing."""

from __future__ import annotations

import numpy as np

import qdem_fem as q
from validation.bench.qdem.checks import figures_row, reported
from validation.bench.qdem.contact import CASES, MODELS, account, momenta, near_critical
from validation.bench.qdem.grains import FRICTION, GRAIN, RADIUS, STIFFNESS, lattice, seconds_a_step
from validation.case import Check
from validation.studies.qdem_contact.faces import faces_checks
from validation.studies.qdem_contact.hertz import hertz_checks
from validation.study import Row


def at_most(name: str, value: float, bar: float) -> Check:
    """A value and its upper bar."""
    return Check(name, float(value), f"<= {bar:g}", bool(value <= bar))


def faces() -> Row:
    """Vertices on vertices, and between them, on two sizes of mesh, by all models."""
    return figures_row(faces_checks())


def hertz() -> Row:
    """Force and radius on three meshes."""
    return figures_row(hertz_checks())


def hard() -> Row:
    """All hard cases by all models, and steps at the critical one."""
    checks = []
    for words, case in CASES.items():
        for model in MODELS:
            run, duration = case(model)
            before = momenta(run)
            gap, stored, lost = account(run, duration)
            name = f"hard case, {words}, {model}"
            checks += [
                at_most(f"{name}: energies do not close", gap, 1e-3),
                reported(f"{name}: contact stored at most", stored),
                reported(f"{name}: friction took", lost),
            ]
            if words == "spinning grain":
                change = np.abs(momenta(run) - before)[3:].max() / np.linalg.norm(before[3:])
                checks.append(at_most(f"{name}: change of angular momentum", change, 1e-9))
    for model in MODELS:
        name = f"hard case, critical step with contact, {model}"
        (gap, early), (_, warned) = (near_critical(model, share) for share in (0.999, 1.001))
        checks += [
            reported(f"{name}: energies do not close at 0.999", gap),
            at_most(f"{name}: warned at 0.999", early, 0),
            Check(f"{name}: warned at 1.001", float(warned), ">= 1", warned),
        ]
    return figures_row(checks)


def packing() -> Row:
    """What contact costs of a step of 216 grains, one thread."""
    checks = []
    for model, near in (("spheres", 0.95), ("surface", 0.96)):
        touch: q.SphereContact | q.SurfaceContact = q.SurfaceContact(STIFFNESS, FRICTION)
        size = GRAIN
        if model == "spheres":
            touch, size = q.SphereContact(RADIUS, STIFFNESS, FRICTION), GRAIN + RADIUS
        runs = [
            q.Simulation(lattice(6, 2 * near * size), threads=1, step=1e-8, contact=contact)
            for contact in (None, touch)
        ]
        without, step = seconds_a_step(runs, 300, 5)
        share, name = 1 - without / step, f"packing of 216 grains, {model}: "
        checks += [
            at_most(f"{name}share of contact in a step", share, 0.3)
            if model == "spheres"
            else reported(f"{name}share of contact in a step", share),
            reported(f"{name}step", step, "s"),
        ]
    return figures_row(checks)


PARTS = {"faces": faces, "hertz": hertz, "hard": hard, "packing": packing}
