"""Whether a prepared bed bears its sleeper under one axle: slow pulses, and what they leave.

Kinetic damping stops what moves, so a bed passes for one at rest and may all the same give way when
its sleeper is loaded and let go.  Slow pulses of the greatest force on a rail seat, with the
friction of the run, find this (`press_sleeper`) and run the bed in, as trains do (`run_in`).
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.bodies import Body, Rigid
from qdem_fem.contact.spheres import SphereContact
from qdem_fem.files import Integers, NotConverged, Series
from qdem_fem.march import Simulation, find_rest
from qdem_fem.track.bed import Bed, enter_bed, guide_sleeper, write_bed
from qdem_fem.track.bogie import DOWN
from qdem_fem.track.recipe import SLEEPER, BedRecipe, make_bed_bodies, make_bed_grains


@dataclass(frozen=True)
class PulseNumbers:
    """Slow pulses."""

    lasts: float = 0.01  # up and down as a cosine [s]: five periods of the sleeper on its grains
    most: int = 10  # that run a bed in [-]: each costs about as much as its preparation


PULSES = PulseNumbers()


@dataclass(frozen=True)
class Pulse:
    """What a slow pulse did to the sleeper."""

    friction: float
    force: float  # on each rail seat, the greatest [N]
    way: float  # down, under that force [m]
    sunk: float  # what is left of it at rest [m]
    aside: float  # horizontally, at rest [m]

    @property
    def stays(self) -> float:
        """The greater of what is left, down, up or aside, over the way under the force [-]."""
        if self.force == 0:
            return 0.0
        return max(abs(self.sunk), self.aside) / self.way if self.way > 0 else np.inf

    def describe(self) -> str:
        """In a sentence's words."""
        return (
            f"with friction {self.friction:g} a slow pulse of {self.force:.4g} N on a rail seat "
            f"moves the sleeper {1e6 * self.way:.3g} µm down and leaves it "
            f"{1e6 * self.sunk:.3g} µm down and {1e6 * self.aside:.3g} µm aside"
        )


def begin_bed(
    recipe: BedRecipe, bed: Bed, contact: SphereContact, rigid: Rigid = False, **options: Any
) -> tuple[Simulation, dict[str, Body]]:
    """A simulation that begins in a prepared bed, and its bodies by name; ``options``: its own.

    Rails hold the seats along the track: free, a sleeper tilts under a load that stays upright and
    walks aside.  Where grains are ``rigid`` they keep the shape that they have at rest, and the
    sleeper its strain: no force is another.
    """
    nodes = [*bed.positions[:-1], bed.nodes[-1]] if rigid else bed.nodes
    bodies = make_bed_bodies(
        recipe, make_bed_grains(recipe), nodes, rigid=rigid, sleeper_rigid=False
    )
    run = Simulation(list(bodies.values()), gravity=recipe.gravity, contact=contact, **options)
    sleeper = bodies[SLEEPER]
    guide_sleeper(run, sleeper, upright=False)
    enter_bed(run, bed)
    for seat in list_seats(sleeper):
        run.prescribe(sleeper, seat, "y", 1.0, profile=sleeper.displacement[:, 1])
    return run, bodies


def list_seats(sleeper: Body) -> list[Integers]:
    """Nodes of each rail seat."""
    sets = sleeper.mesh.node_sets
    return [sets[name] for name in sorted(sets) if name.startswith("seat")]


def press_sleeper(run: Simulation, recipe: BedRecipe, force: float) -> Pulse:
    """Load the rail seats slowly up to ``force`` [N] each and back, then bring all to rest.

    Raises `NotConverged` where that finds no equilibrium.
    """
    sleeper, turn = run.bodies[-1], np.linspace(0, 2 * np.pi, 41)
    times = run.time + PULSES.lasts * turn / (2 * np.pi)
    load = Series(times, np.outer(force * (1 - np.cos(turn)) / 2, DOWN))
    for seat in list_seats(sleeper):
        run.load(sleeper, seat, load)
    before = sleeper.displacement.mean(axis=0)
    run.advance(PULSES.lasts / 2)
    way = before[2] - sleeper.displacement[:, 2].mean()
    run.advance(PULSES.lasts / 2)
    shares = recipe.unbalanced, recipe.kinetic, recipe.loose
    find_rest(run, *shares, recipe.patience, each=not recipe.periodic)
    x, y, z = sleeper.displacement.mean(axis=0) - before
    assert run.contact is not None
    return Pulse(run.contact.friction, force, float(way), -float(z), float(np.hypot(x, y)))


def run_in(
    recipe: BedRecipe, bed: Bed, path: Path, contact: SphereContact, force: float, stays: float,
    threads: int | None = None, rigid: Rigid = False,
) -> tuple[Bed, Pulse]:  # fmt: skip
    """Press a bed until it bears: until a pulse of ``force`` [N] leaves at most ``stays``.

    The bed that bears, and that pulse, which is no part of it.  The file ``path`` keeps what each
    pulse found and left.  Raises `NotConverged` behind `PULSES.most` pulses of this friction and
    force that leave more.
    """
    name = name_trial(contact, force, rigid)
    while not (name in bed.trials and Pulse(**bed.trials[name]).stays <= stays):
        tried = [p for p in (Pulse(**one) for one in bed.pulses)
                 if (p.friction, p.force) == (contact.friction, force)]  # fmt: skip
        if len(tried) >= PULSES.most:
            raise NotConverged(
                "the bed does not bear its sleeper, nor do slow pulses run it in: behind "
                f"{len(tried)} of them {tried[-1].describe()} ({stays:g} of "
                "the way asked)", where=str(path),
                remedy="remove it, and take another track.seed, more ballast beside the sleeper "
                "(track.beside) or less load, or allow more (track.stays)",
            )  # fmt: skip
        run, _ = begin_bed(recipe, bed, contact, rigid, threads=threads)
        pulse = press_sleeper(run, recipe, force)
        if pulse.stays <= stays:
            bed = replace(bed, trials={**bed.trials, name: asdict(pulse)})
        else:
            assert run.contacts is not None
            there = [body.nodes + body.displacement for body in run.bodies]
            bed = replace(
                bed, displacement=np.concatenate(there) - np.concatenate(bed.nodes), trials={},
                contact=run.contacts.pack_state(), pulses=[*bed.pulses, asdict(pulse)],
            )  # fmt: skip
        write_bed(path, recipe, bed)
    return bed, Pulse(**bed.trials[name])


def name_trial(contact: SphereContact, force: float, rigid: Rigid) -> str:
    """Under which name a bed's file keeps the pulse that it bears in a run."""
    kind = ", grains rigid" + (" (lumped)" if rigid == "lumped" else "") if rigid else ""
    return f"friction {contact.friction:g}, {force:.4g} N{kind}"
