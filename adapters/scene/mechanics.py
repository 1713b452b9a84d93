"""Whether the numbers of a scene make mechanical sense; each check is a few lines of mechanics."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import hypot, inf
from pathlib import Path

from adapters import bed
from adapters.errors import SceneError
from adapters.files import read_load_series
from adapters.scene.values import Check, NotValid, Values
from trackbed.plausible import Quantity, describe_implausible
from trackbed.scene_files import Problem

COUNT_GREATEST = 10**8
"""Most grains a scene may have."""


@dataclass(frozen=True)
class DoubtfulNumbers:
    """Ends of what is free of doubt."""

    rayleigh_share: float = 0.4
    """Greatest time step over the Rayleigh time [-], which the scene's word "fast" stands for: what
    it costs in accuracy is measured in docs/engines.md."""
    width: int = 8  # least one of a container [mean grain diameters]
    own_frequency: float = 4.0  # of a piston on its bed over the load's: below, inertia is felt [-]
    wall_give: float = 10.0  # of what a grain enters a wall over what it enters another grain [-]
    gap: float = 0.5
    """Gap to all below from which a grain floats [mean radii]; none of 265 settled beds has it."""
    steps: int = 100  # least number of time steps a cycle
    jump: int = 10  # most cycles of one for each cycle fitted: above, noise is extrapolated


DOUBTFUL = DoubtfulNumbers()


def _check_room(scene: Values) -> Iterator[Problem]:
    largest_grain = scene.radii.greatest * scene.form.reach
    room = bed.find_radius_that_fits(scene.container)
    if largest_grain > room:
        yield Problem(
            scene.radii_key,
            f"radii up to {largest_grain:g} m do not fit: "
            f"the container takes radii up to {room:g} m",
        )


def _list_levels(scene: Values) -> list[tuple[float, float]]:
    """Mean and amplitude of each stage of a sine [Pa]."""
    first = scene["loading.mean"], scene["loading.amplitude"]
    stages = scene.get("loading.stage") or ()
    return [first, *((stage["mean"], stage["amplitude"]) for stage in stages)]


def _check_tension(scene: Values) -> Iterator[Problem]:
    trough = min(mean - amplitude / 2 for mean, amplitude in _list_levels(scene))
    if trough < 0:
        yield Problem(
            "loading.mean",
            f"the stress would fall to mean - amplitude/2 = {trough:g} Pa: a piston can not pull",
        )


def _find_rayleigh_time(scene: Values) -> float:
    radii = scene.radii
    if radii.smallest <= 0:
        raise NotValid
    named = (scene[f"material.grain.{one}"] for one in ("density", "young", "poisson"))
    return bed.find_rayleigh_time(scene.form.least * radii.smallest, *named)


def _find_rayleigh_share(scene: Values) -> float:
    if scene.get("engine.time_step") is None:
        return float(scene["engine.rayleigh_share"])
    return float(scene["engine.time_step"]) / _find_rayleigh_time(scene)


def _check_time_step(scene: Values) -> Iterator[Problem]:
    share = _find_rayleigh_share(scene)
    if share > 1:
        yield Problem(
            "engine.time_step",
            f"{share:.3g} Rayleigh times of the smallest grain "
            f"({_find_rayleigh_time(scene):.3g} s): the grains would explode",
        )


def _check_fill_height(scene: Values) -> Iterator[Problem]:
    height = scene["sample.fill_height"]
    count = bed.expect_grains(scene.radii, scene.container, height)
    if not 1 <= count <= COUNT_GREATEST:
        yield Problem("sample.fill_height", f"{height:g} m would take {count:.3g} grains")


def _find_overlap_share(scene: Values) -> tuple[str, float, float]:
    """Key of the load, its greatest stress [Pa], mean overlap under it over the smallest radius.

    A grain of a layer carries the stress on the square that it fills, (2 r)^2.
    """
    if scene["loading.waveform"] == "sine":
        key = "loading.amplitude"
        stress = max(mean + amplitude / 2 for mean, amplitude in _list_levels(scene))
    else:
        key = "loading.series"
        try:
            series = read_load_series(Path(scene[key]))
        except SceneError as error:
            raise NotValid from error
        stress = float(series.stress.max())
    radii, grain = scene.radii, "material.grain."
    if radii.smallest <= 0:
        raise NotValid
    young, poisson = scene[grain + "young"], scene[grain + "poisson"]
    modulus = bed.combine_moduli(young, poisson, young, poisson)
    usual, force = scene.form.usual, stress * (2 * radii.mean) ** 2
    overlap = bed.find_overlap_under_force(force, modulus, usual * radii.mean / 2)
    return key, stress, float(overlap) / (usual * radii.smallest)


def _check_load(scene: Values) -> Iterator[Problem]:
    key, stress, share = _find_overlap_share(scene)
    if share > bed.OVERLAP_BOUND:
        yield Problem(
            key,
            f"a stress of {stress:.3g} Pa presses grains {share:.2g} of the smallest radius into "
            f"one another; Hertz contact is a law up to {bed.OVERLAP_BOUND:g}: "
            "a smaller load, or stiffer grains",
        )


CHECKS: tuple[Check, ...] = (
    _check_room, _check_fill_height, _check_tension, _check_time_step, _check_load,
)  # fmt: skip
"""What is wrong."""


def _warn_of_long_step(scene: Values) -> Iterator[Problem]:
    share = _find_rayleigh_share(scene)
    if DOUBTFUL.rayleigh_share < share <= 1:
        key = "rayleigh_share" if scene.get("engine.time_step") is None else "time_step"
        yield Problem(
            f"engine.{key}",
            f"{share:.2g} of the Rayleigh time; above {DOUBTFUL.rayleigh_share} collisions "
            "gain energy and settlement is doubtful",
        )


def _warn_of_narrow_bed(scene: Values) -> Iterator[Problem]:
    container = scene.container
    is_box = container.shape == "box"
    width = min(container.size_x, container.size_y) if is_box else 2 * container.radius
    ratio = width / (2 * scene.radii.mean)
    if ratio < DOUBTFUL.width:
        yield Problem(
            scene.radii_key,
            f"the container is {ratio:.2g} mean grain diameters wide: walls rule the result",
        )


def find_wedge_ratio(friction: float) -> float:
    """Ratio of radii R/r from which friction alone holds a small grain between two large ones [-].

    In the groove between grains that touch a contact makes an angle theta with their axis,
    cos theta = R/(R + r), and friction holds what is pressed in if tan theta < ``friction``.  There
    an error of velocity Verlet, which gives friction's spring the half step's velocity and the full
    step's normal, makes a grain stick that should roll off (Vyas et al. 2025,
    doi 10.1016/j.cpc.2025.109524; docs/size-ratio.md).
    """
    square = friction**2
    return (hypot(1, friction) + 1) / square if square else inf


def _warn_of_size_ratio(scene: Values) -> Iterator[Problem]:
    radii, friction = scene.radii, scene["material.grain.friction"]
    if radii.smallest <= 0:
        raise NotValid
    ratio, limit = radii.greatest / radii.smallest, find_wedge_ratio(friction)
    if ratio > limit:
        yield Problem(
            scene.radii_key.removesuffix(".mean"),
            f"radii differ by a factor of {ratio:.3g}; with friction {friction:g} small grains may "
            f"stick between large ones above {limit:.3g}, by an error of the engines' integration "
            "(docs/size-ratio.md): leave the smallest out to see whether it matters",
        )


def _warn_of_few_steps(scene: Values) -> Iterator[Problem]:
    longest = _find_rayleigh_share(scene) * _find_rayleigh_time(scene)
    steps = 1 / (scene["loading.frequency"] * longest)
    if steps < DOUBTFUL.steps:
        yield Problem("loading.frequency", f"a cycle is only {steps:.3g} time steps long")


def _warn_of_deep_chains(scene: Values) -> Iterator[Problem]:
    key, stress, share = _find_overlap_share(scene)
    deepest = bed.CHAIN_FACTOR ** (2 / 3) * share
    if deepest > bed.OVERLAP_BOUND:
        yield Problem(
            key,
            f"under {stress:.3g} Pa overlaps reach about {deepest:.2g} of the smallest radius in "
            f"force chains; above {bed.OVERLAP_BOUND:g} a run is refused",
        )


def _warn_of_far_jump(scene: Values) -> Iterator[Problem]:
    if scene.get("procedure.settlement") == "history":  # by all cycles computed so far
        return
    h, k = max(scene["procedure.h"]), scene["procedure.k"]
    if h > DOUBTFUL.jump * k:
        yield Problem(
            "procedure.h",
            f"a jump of {h} cycles is fitted to {k}: above {DOUBTFUL.jump} times as many it "
            "extrapolates their noise, and the bed may even rise",
        )


SIZES: tuple[tuple[str, Quantity, float], ...] = (
    ("material.grain.friction", "friction", 1), ("material.wall.friction", "friction", 1),
    ("material.grain.young", "young", 1), ("material.wall.young", "young", 1),
    ("material.grain.density", "density", 1), ("loading.crib", "crib", 1), ("", "grain", 2),
    ("sample.radius", "body", 2), ("sample.size_x", "body", 1), ("sample.size_y", "body", 1),
)  # fmt: skip
"""Keys (none: the mean radius) that are looked at for other units than SI, factors to sizes."""


def _warn_of_implausible_size(
    key: str, quantity: Quantity, factor: float, scene: Values
) -> Iterator[Problem]:
    key = key or scene.radii_key
    value = scene.radii.mean if quantity == "grain" else scene[key]
    if said := describe_implausible(quantity, factor * value, key):
        yield Problem(key, said.removeprefix(f"{key}: "))


IMPLAUSIBLE = tuple(partial(_warn_of_implausible_size, *row) for row in SIZES)
DOUBTS: tuple[Check, ...] = (
    *IMPLAUSIBLE,
    _warn_of_long_step, _warn_of_narrow_bed, _warn_of_few_steps, _warn_of_size_ratio,
    _warn_of_deep_chains, _warn_of_far_jump,
)  # fmt: skip
"""What is doubtful."""
