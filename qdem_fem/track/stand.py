"""Whether a prepared bed stands: let go without its load, how much its sliders take.

Kinetic damping stops what moves, so a bed whose contacts lie at Coulomb's limit passes for one at
rest, and creeps when it is let go.  That hangs on the friction of the run, which may be another
than the one the bed was prepared with.
"""

from __future__ import annotations

import warnings
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.bodies import Body, Rigid
from qdem_fem.contact import SphereContacts
from qdem_fem.contact.spheres import SphereContact, find_pair_stiffness
from qdem_fem.files import Floats, NotConverged, StepWarning
from qdem_fem.march import Simulation
from qdem_fem.track.bed import Bed, enter_bed, guide_sleeper, write_bed
from qdem_fem.track.recipe import SLEEPER, BedRecipe, make_bed_bodies, make_bed_grains

NEARLY = 0.99
"""Of Coulomb's limit, what counts as being there."""


@dataclass(frozen=True)
class Stand:
    """How a bed stands with the friction of a run."""

    friction: float
    time: float
    """Without the load [s]."""
    pairs: int
    """Of spheres that touch, at first."""
    median: float
    """Of the friction in use at first, ``|F_t|/(mu F_n)`` [-]."""
    at_limit: float
    """Share of pairs `NEARLY` at Coulomb's limit, at first [-]."""
    sinking: float
    """Of the sleeper [m]."""
    slid: float
    """Work of the sliders [J]."""
    elastic: float
    """Energy of springs and elements, at first [J]."""

    @property
    def creep(self) -> float:
        """Work of sliders over energy of springs and elements [-]."""
        if self.slid == 0:
            return 0.0
        return self.slid / self.elastic if self.elastic > 0 else np.inf

    def describe(self) -> str:
        """In a sentence's words."""
        return (
            f"let go for {1e3 * self.time:g} ms with friction {self.friction:g}, its sliders take "
            f"{self.creep:.2g} of the energy of its springs, and {self.at_limit:.0%} of the pairs "
            "that touch are at Coulomb's limit"
        )


def find_friction_in_use(run: Simulation, recipe: BedRecipe, friction: float) -> Floats:
    """Friction in use ``|F_t|/(mu F_n)`` of each pair that touches [-], (p,).

    ``F_n`` is k_n times the overlap; what else there is of the force is across it.
    """
    assert isinstance(run.contacts, SphereContacts)
    run.contacts.refresh()
    found = run.contacts.touching()
    sleeper = np.maximum(found.first, found.second) >= run.first_node[-2]
    push = found.overlap * np.where(
        sleeper, find_pair_stiffness(*recipe.stiffness), recipe.stiffness[0]
    )
    across = np.sqrt(np.maximum((found.force**2).sum(axis=1) - push**2, 0.0))
    return np.asarray(across / (friction * push)) if friction > 0 else np.ones_like(push)


def begin_bed(
    recipe: BedRecipe, bed: Bed, contact: SphereContact, rigid: Rigid = False, **options: Any
) -> tuple[Simulation, dict[str, Body]]:
    """A simulation that begins in a prepared bed, and its bodies by name; ``options``: its own.

    Where grains are ``rigid`` they keep the shape that they have at rest, and the sleeper its
    strain: no force is another.
    """
    nodes = [*bed.positions[:-1], bed.nodes[-1]] if rigid else bed.nodes
    bodies = make_bed_bodies(
        recipe, make_bed_grains(recipe), nodes, rigid=rigid, sleeper_rigid=False
    )
    run = Simulation(list(bodies.values()), gravity=recipe.gravity, contact=contact, **options)
    guide_sleeper(run, bodies[SLEEPER], upright=False)
    enter_bed(run, bed)
    return run, bodies


def let_bed_stand(
    recipe: BedRecipe, bed: Bed, contact: SphereContact, time: float,
    threads: int | None = None, rigid: Rigid = False,
) -> Stand:  # fmt: skip
    """Let a bed go without its load for ``time`` [s]; warnings of its step are left to the run."""
    run, bodies = begin_bed(recipe, bed, contact, rigid, threads=threads)
    used = find_friction_in_use(run, recipe, contact.friction)
    before, energy = bodies[SLEEPER].displacement[:, 2].mean(), run.energy()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        run.advance(time)
    return Stand(
        contact.friction, time, len(used), float(np.median(used)) if len(used) else 0.0,
        at_limit=float((used > NEARLY).sum() / max(len(used), 1)),
        sinking=float(before - bodies[SLEEPER].displacement[:, 2].mean()),
        slid=run.energy().friction, elastic=energy.elastic + energy.contact,
    )  # fmt: skip


def judge_bed(
    recipe: BedRecipe, bed: Bed, path: Path, contact: SphereContact, time: float, creep: float,
    threads: int | None = None, rigid: Rigid = False,
) -> Stand:  # fmt: skip
    """How the bed in the file ``path`` stands, which keeps the answer; ``creep``: the most allowed.

    Raises `NotConverged` for a bed that creeps more.
    """
    kind = ", grains rigid" + (" (lumped)" if rigid == "lumped" else "") if rigid else ""
    key = f"friction {contact.friction:g}, {time:g} s{kind}"
    if key not in bed.stands:
        stand = let_bed_stand(recipe, bed, contact, time, threads, rigid)
        bed = replace(bed, stands={**bed.stands, key: asdict(stand)})
        write_bed(path, recipe, bed)
    stand = Stand(**bed.stands[key])
    if not stand.creep <= creep:
        raise NotConverged(
            f"the bed creeps: {stand.describe()} ({creep:g} asked)", where=str(path),
            remedy="prepare it with less friction than the run has (track.prepared_friction), or "
            "allow more (track.creep)",
        )  # fmt: skip
    return stand
