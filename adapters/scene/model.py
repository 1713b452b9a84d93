"""What a scene's model leaves out, in sentences, derived from the scene."""

from collections.abc import Iterator

from adapters.bed import DAMPING_FACTOR, find_literal_restitution, solve_collision
from adapters.scene.tables import Scene

ENGINE_TITLES = {"auto": "LIGGGHTS", "liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
"""Engines as their users write them."""
KEPT = {"auto": "spring", "liggghts": "spring", "yade": "force"}
"""What engines without the paper's rule keep when the normal force decreases."""


def list_omissions(scene: Scene) -> tuple[str, ...]:
    """Sentences on what the model of ``scene`` does not have; read before the result is used."""
    parts = (_list_grains, _list_contacts, _list_bed, _list_load, _list_jumps)
    return tuple(text for part in parts for text in part(scene))


def _list_grains(scene: Scene) -> Iterator[str]:
    if scene.engine.name == "fake":
        yield "Mechanics: the engine is the fake one of the tests, and no figure here is a result."
    if not scene.stones:
        yield "Stones: grains are spheres, without edges that interlock."
    else:
        yield (
            f"Edges and faces of stones: each is {len(scene.form.radius)} spheres that keep their "
            f"places, of the form {scene.form.name}, with its mass and inertia; ten sizes at most."
        )
    yield "Breakage, abrasion and wear of grains."
    law = scene.sample.grain_radius
    if law is None:
        low, high = scene.sample.radii.smallest, scene.sample.radii.greatest
        yield f"Grains below {2e3 * low:.4g} mm and above {2e3 * high:.4g} mm; fines and water."
    elif law.distribution == "normal" and law.standard_deviation:
        yield (f"Radii beyond {law.truncation:g} standard deviations of the mean; fines and water.")
    else:
        yield "Fines and water."


def _list_contacts(scene: Scene) -> Iterator[str]:
    grain = scene.material.grain
    if scene.sample.state is not None:
        yield "The saved bed's history: its grains settle from rest, contacts without springs."
    yield "Plastic and adhesive contacts: Hertz's law is elastic, for overlaps far below a radius."
    if grain.rolling_friction:
        yield "Spinning resistance: a grain may spin about the normal of its contact without end."
    elif grain.friction or scene.material.wall.friction:
        yield "Rolling and spinning resistance: a loose grain may spin without end."
    if grain.friction and scene.engine.name in KEPT:
        yield (
            "The paper's rule that rescales the tangential force when the normal one decreases "
            f"(Elata and Berryman): {ENGINE_TITLES[scene.engine.name]} keeps the "
            f"{KEPT[scene.engine.name]} and cuts it at Coulomb's limit."
        )
    elif not grain.friction:
        yield "Friction between grains: its coefficient is 0, so the bed has no tangential forces."
    if not scene.material.wall.friction:
        yield "Friction at the walls: its coefficient is 0."
    if grain.viscous_alpha is not None and grain.viscous_alpha < DAMPING_FACTOR:
        literal = find_literal_restitution(grain.viscous_alpha)
        rebound, why = scene.restitution, ""
        if scene.engine.name == "yade":
            ratio = DAMPING_FACTOR * grain.viscous_alpha
            rebound = solve_collision(1.0, 1.0, 1.0, 1.0, ratio, may_pull=False).restitution
            why = ", since its contacts never pull"
        yield (
            f"A literal eq. 7: {ENGINE_TITLES.get(scene.engine.name, 'the engine')} damps by "
            f"sqrt(5/6) = {DAMPING_FACTOR:.3f} of it, which makes the restitution {rebound:.4f} at "
            f"any speed (literal: {literal:.4f}){why}."
        )


def _list_bed(scene: Scene) -> Iterator[str]:
    if scene.container.sides:
        yield (
            f"The round wall: YADE has none, and {scene.container.sides} planes about the whole "
            "circle, tangent to the cylinder, stand for it."
        )
    if scene.sample.symmetry:
        part = {1: "half", 2: "a quarter"}[len(scene.sample.symmetry)]
        yield (
            f"The other sectors: {part} of the container is computed between rigid, frictionless "
            "mirror planes, at which grains cannot cross."
        )
    yield "Sleepers, subgrade and the track's stiffness: floor, walls and piston are rigid."
    share = scene.time_step / scene.rayleigh_time
    step = f"{scene.time_step:.3g} s, {share:.2f} of the smallest grain's Rayleigh time"
    yield f"Times below the step of {step}."


def _list_load(scene: Scene) -> Iterator[str]:
    if scene.loading is None:
        yield "A load: the scene names none, so only the preparation was run."
        return
    yield (
        "The piston's weight: gravity does not act on it, its mass is inertia only, and the mean "
        "stress stands for dead load."
    )
    if scene.loaded_area < scene.container.area:
        yield "A thick piston: it is a plate, and grains may rise beside it and above it."
    if scene.loading.crib:
        yield "Strength and interlock of the ballast beside the block: it is weight alone."


def _list_jumps(scene: Scene) -> Iterator[str]:
    if (
        scene.procedure is None
        or scene.loading is None
        or not (scene.procedure.tolerance or any(scene.procedure.h or ()))
    ):
        return
    if scene.stones:
        yield "Rotations of jumped cycles: stones are moved whole, and turn as they are relaxed."
    yield (
        "The dynamics of jumped cycles: positions follow the law "
        f"'{scene.procedure.law}', moved '{scene.procedure.move}', grains restart at rest, and "
        "contacts that a jump opens lose their tangential springs."
    )
