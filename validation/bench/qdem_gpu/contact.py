"""Contact of spheres on a GPU beside that on the processor: the same scenes, the same steps."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

import qdem_fem as q
from qdem_fem.contact.sphere_state import SphereContacts
from qdem_fem.files.errors import ContactTooDeep
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem_gpu.search import compare_searches

SIDE, RADIUS = 0.03, 0.006
STONE = q.Material(1e9, 0.2, 2700.0)
STEPS = 15
ROUND_OFF = 50.0
"""Roundings of a step by which two orders of the same sums may differ, over the largest value."""


SLIDES = 0.5, -0.3, -0.2
"""Velocity of the upper cube [m/s]."""


def stack_cubes(
    device: Any, periodic: bool = False, velocity: Any = SLIDES, **contact: Any
) -> q.Simulation:
    """A cube that slides fast on another, which stands on a wall; or across a periodic side."""
    apart = 2 * RADIUS - 2e-6
    shift = np.array([0.004, 0.002, SIDE + np.sqrt(apart**2 - 0.004**2 - 0.002**2)])
    touch: dict[str, Any] = {"planes": [q.ContactPlane((0, 0, -RADIUS + 1e-5), (0, 0, 1), 0.2)]}
    if periodic:  # the upper cube meets the image of the lower one, a width ahead
        touch = {"periodic": q.PeriodicWidth("y", 0.08)}
        shift += (0, 0.08, 0)
    bodies = [
        q.Body(make_box_mesh((SIDE,) * 3, (1, 1, 1), "kuhn", tuple(origin)), STONE, name=name)
        for name, origin in (("below", np.zeros(3)), ("above", shift))
    ]
    stiffness = {"below": 1e6, "above": 2e6}
    run = q.Simulation(
        bodies, threads=1, step=1.2e-6, device=device, gravity=(0.0, 0.0, -9.81),
        contact=q.SphereContact(RADIUS, stiffness, 0.5, **(touch | contact)),
    )  # fmt: skip
    bodies[1].velocity = np.tile(velocity, (len(bodies[1].nodes), 1))
    return run


def collect_state(run: q.Simulation) -> dict[str, Any]:
    """What steps have changed, by name."""
    contacts, energy = run.contacts, run.energy()
    assert isinstance(contacts, SphereContacts)
    kernel, touching = contacts.kernel, contacts.touching()
    return {
        "displacement": np.concatenate([body.displacement for body in run.bodies]),
        "velocity": np.concatenate([body.velocity for body in run.bodies]),
        "force": kernel.force, "spring": touching.spring, "pull": touching.force,
        "wall spring": kernel.planes.spring, "slid": kernel.slid,
        "sums": np.append(run.assembly.kinetic_energy(), run.assembly.moment()),
        "gravity": np.array([run.motion.gravity_work]),
        "energies": np.array([energy.contact, energy.friction, energy.kinetic, energy.elastic]),
        "counts": np.array([contacts.renewals, contacts.lasted, len(touching.first)]),
        "skin": np.array([contacts.skin, run.steps_done]),
        "bound": np.array([contacts.bound_present_stiffness()]),
    }  # fmt: skip


@contextmanager
def guard_processor(run: q.Simulation) -> Iterator[list[str]]:
    """What steps on a GPU should leave alone: the processor's search and step raise, and copies of
    contact or of a field to the host are listed."""
    if run.device == "cpu":
        yield []
        return
    from qdem_fem.contact.cuda.arrays import DeviceContact
    from qdem_fem.kernel.cuda.assembly import CudaAssembly

    copies: list[str] = []
    fetch, read = DeviceContact.fetch, CudaAssembly._read

    def fetch_noted(*given: Any) -> Any:
        copies.append("contact")
        return fetch(*given)

    def read_noted(*given: Any) -> Any:
        copies.append("a field")
        return read(*given)

    refused = AssertionError("the processor was asked")
    with (
        patch("qdem_fem.contact.search.renew_pairs", side_effect=refused),
        patch("qdem_fem.contact.state.advance_contact", side_effect=refused),
        patch.object(DeviceContact, "fetch", fetch_noted),
        patch.object(CudaAssembly, "_read", read_noted),
    ):
        yield copies


def compare_marches(moved: float = 0.0, restored: bool = False, **asked: Any) -> float:
    """Greatest difference after `STEPS` in marches of unequal length, over its bar.

    ``asked``: of `stack_cubes`; behind the first march the upper cube is set ``moved`` [m] higher,
    or springs are let go and ``restored`` from what was stored.  The list has to be made in the
    same steps, and within a march no array comes to the host.
    """
    states = []
    for device in ("cpu", "cuda"):
        run = stack_cubes(device, **asked)
        with guard_processor(run) as copies:
            run.advance(round(0.35 * STEPS) * run.step)
            if moved:
                run.bodies[1].displacement += np.array([0.0, 0.0, moved])
            if restored:
                assert run.contacts is not None
                kept = {name: array.copy() for name, array in run.contacts.pack_state().items()}
                run.contacts.forget()
                run.contacts.restore(kept)
            run.advance(round(0.15 * STEPS) * run.step)
            before = len(copies)
            run.advance(round(0.5 * STEPS) * run.step)
            if len(copies) > before:
                return float("inf")
        states.append(collect_state(run))
    one, other = states
    if not np.array_equal(one["counts"], other["counts"]) or not one["energies"][:2].all():
        return float("inf")
    bar = ROUND_OFF * STEPS * float(np.finfo(float).eps)
    return max(
        float(abs(one[name] - other[name]).max() / abs(one[name]).max()) / bar
        for name in one
        if one[name].size and one[name].any()
    )


def compare_too_deep() -> float:
    """Two that are driven into each other: both stop at the same step with the same words."""
    said = []
    for device in ("cpu", "cuda"):
        run = stack_cubes(device)
        run.bodies[1].velocity = np.tile([0.0, 0.0, -400.0], (len(run.bodies[1].nodes), 1))
        try:
            run.advance(3 * STEPS * run.step)
            return float("inf")
        except ContactTooDeep as error:
            said.append((str(error), run.steps_done))
    return 0.0 if said[0] == said[1] else float("inf")


MARCHES: dict[str, dict[str, Any]] = {
    "walls, sliders, one list": {"skin": 6e-3},
    "walls, sliders, many lists": {"skin": 2e-6},
    "images across a width": {"skin": 1e-3, "periodic": True},
    "images, many lists": {"skin": 2e-6, "periodic": True},
    "a skin that follows the motion": {"velocity": (-300.0, 50.0, 1.0)},
    "parted by more than the skin": {"velocity": (3.0, -2.0, 1.0), "skin": 1e-7},
    "a body set elsewhere": {"skin": 2e-6, "moved": 1e-6},
    "springs restored": {"skin": 2e-6, "restored": True},
    "images restored": {"skin": 1e-3, "periodic": True, "restored": True},
    "a step for what is near": {"skin": 2e-4, "contacts": "near"},
}
"""What `compare_contacts` is asked, by name."""


def compare_contacts() -> dict[str, float]:
    """Differences over their bars, by name."""
    found = {f"contact: {name}": compare_marches(**asked) for name, asked in MARCHES.items()}
    return found | {"contact: too deep": compare_too_deep()} | compare_searches()
