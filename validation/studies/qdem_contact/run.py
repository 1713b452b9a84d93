"""The parts: cubes pressed, Hertz, hard cases, a packing."""

from __future__ import annotations

import numpy as np

import qdem_fem as q
from validation.bench.qdem.checks import make_row, report
from validation.bench.qdem.contact import CASES, MODELS, audit_energy, collide_cubes, sum_momenta
from validation.bench.qdem.grains import FRICTION, GRAIN, RADIUS, STIFFNESS, lay_lattice, time_steps
from validation.case import Check
from validation.studies.qdem_contact.faces import check_faces
from validation.studies.qdem_contact.hertz import check_hertz
from validation.study import Row


def check_max(name: str, value: float, bar: float) -> Check:
    """A value and its upper bar."""
    return Check(name, float(value), f"<= {bar:g}", bool(value <= bar))


def run_faces() -> Row:
    """Vertices on vertices, and between them, on two sizes of mesh, by all models."""
    return make_row(check_faces())


def run_hertz() -> Row:
    """Force and radius on three meshes."""
    return make_row(check_hertz())


def run_hard_cases() -> Row:
    """All hard cases by all models, and steps at the critical one."""
    checks = []
    for words, case in CASES.items():
        for model in MODELS:
            run, duration = case(model)
            before = sum_momenta(run)
            gap, stored, lost = audit_energy(run, duration)
            name = f"hard case, {words}, {model}"
            checks += [
                check_max(f"{name}: energies do not close", gap, 1e-3),
                report(f"{name}: contact stored at most", stored),
                report(f"{name}: friction took", lost),
            ]
            if words == "spinning grain":
                change = np.abs(sum_momenta(run) - before)[3:].max() / np.linalg.norm(before[3:])
                checks.append(check_max(f"{name}: change of angular momentum", change, 1e-9))
    for model in MODELS:
        name = f"hard case, critical step with contact, {model}"
        (gap, early), (_, warned) = (collide_cubes(model, share) for share in (0.999, 1.001))
        checks += [
            report(f"{name}: energies do not close at 0.999", gap),
            check_max(f"{name}: warned at 0.999", early, 0),
            Check(f"{name}: warned at 1.001", float(warned), ">= 1", warned),
        ]
    return make_row(checks)


def run_packing() -> Row:
    """What contact costs of a step of 216 grains, one thread."""
    checks = []
    for model, near in (("spheres", 0.95), ("surface", 0.96)):
        touch: q.SphereContact | q.SurfaceContact = q.SurfaceContact(STIFFNESS, FRICTION)
        size = GRAIN
        if model == "spheres":
            touch, size = q.SphereContact(RADIUS, STIFFNESS, FRICTION), GRAIN + RADIUS
        runs = [
            q.Simulation(lay_lattice(6, 2 * near * size), threads=1, step=1e-8, contact=contact)
            for contact in (None, touch)
        ]
        without, step = time_steps(runs, 300, 40)  # five rounds scatter on a shared machine
        share, name = 1 - without / step, f"packing of 216 grains, {model}: "
        checks += [
            check_max(f"{name}share of contact in a step", share, 0.3)
            if model == "spheres"
            else report(f"{name}share of contact in a step", share),
            report(f"{name}step", step, "s"),
        ]
    return make_row(checks)


PARTS = {"faces": run_faces, "hertz": run_hertz, "hard": run_hard_cases, "packing": run_packing}
