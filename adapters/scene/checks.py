"""What the keys of a scene demand of one another; each check is a few lines of mechanics.

A check reads the scene as dotted keys.  It is skipped when a key it asks for is not valid in
itself, so that one wrong key never hides what is wrong elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from adapters.bed import (
    OVERLAP_BOUND,
    Container,
    RadiusDistribution,
    equivalent_modulus,
    expect_grain_count,
    find_radius_that_fits,
    overlap_under_force,
    rayleigh_time,
)
from adapters.errors import SceneError
from adapters.files import read_load_series
from trackbed.choices import find_choices, tell_retired
from trackbed.scene_files import Problem, suggest_word

ALTERNATIVES = (
    ("sample.count", "sample.fill_height"),
    ("material.grain.viscous_alpha", "material.grain.restitution"),
    ("engine.rayleigh_share", "engine.time_step"),
)
"""Pairs of keys of which a scene gives exactly one."""

JUMP_KEYS, TOLERANCE_KEY = ("procedure.k", "procedure.h"), "procedure.tolerance"
"""Cycles computed and jumped by hand, and what stands instead."""

COUNT_GREATEST = 10**8
"""Most grains a scene may have."""

AN_ENGINE = "adapters.engines.fake"
"""A file beside which the engines are; only looked for, as they import the scene."""

MPI_STARTERS = {"mpirun", "mpiexec", "mpiexec.hydra", "orterun", "srun"}
"""Programs that start the program behind them several times."""

RAYLEIGH_SHARE_DOUBTFUL = 0.4
"""Share of the Rayleigh time above which a time step is doubtful."""
WIDTH_DOUBTFUL = 8
"""Least width of a container, in mean grain diameters, that is free of doubt."""
STEPS_DOUBTFUL = 100
"""Least number of time steps a cycle that is free of doubt."""
CHAIN_FACTOR = 10.0
"""Greatest contact force over the mean one in a bed under load, as in
`adapters.relaxation.methods`."""
JUMP_DOUBTFUL = 10
"""Cycles of a jump for each cycle fitted, above which noise is extrapolated and not a law."""


class _NotValid(Exception):
    """A check asked for a key that is not valid in itself."""


class _Values:
    def __init__(self, values: Mapping[str, Any], invalid: Iterable[str]) -> None:
        self._values, self._invalid = values, tuple(invalid)

    def get(self, key: str) -> Any:
        if any(key == bad or key.startswith(bad + ".") for bad in self._invalid):
            raise _NotValid
        return self._values.get(key)

    def need(self, key: str) -> Any:
        value = self.get(key)
        if value is None:
            raise _NotValid
        return value

    def has_table(self, name: str) -> bool:
        self.get(name)
        return any(key.startswith(name + ".") for key in self._values)


Check = Callable[[_Values], Iterator[Problem]]


def _alternatives(scene: _Values) -> Iterator[Problem]:
    for first, second in ALTERNATIVES:
        given = [key for key in (first, second) if _present(scene, key)]
        name = second.rpartition(".")[2]
        if not given:
            yield Problem(first, f"missing: give this or {name}")
        elif len(given) == 2:
            yield Problem(first, f"give this or {name}, not both")


def _present(scene: _Values, key: str) -> bool:
    """Whether a key is given, valid or not; a table that is not valid is another problem."""
    try:
        return scene.get(key) is not None
    except _NotValid:
        scene.get(key.rpartition(".")[0])
        return True


def _container(scene: _Values) -> Iterator[Problem]:
    sizes = {"cylinder": ("radius",), "box": ("size_x", "size_y")}
    shape = scene.need("sample.container")
    for owner, keys in sizes.items():
        for key in keys:
            given = _present(scene, f"sample.{key}")
            if owner == shape and not given:
                yield Problem(f"sample.{key}", f"missing: a {shape} has a {key}")
            if owner != shape and given:
                yield Problem(f"sample.{key}", f"a {shape} has no {key}")


def _symmetry(scene: _Values) -> Iterator[Problem]:
    planes = scene.get("sample.symmetry") or ()
    if len(set(planes)) != len(planes):
        yield Problem("sample.symmetry", "each mirror plane only once")


def _radii(scene: _Values) -> RadiusDistribution:
    table = "sample.grain_radius."
    return RadiusDistribution(
        scene.need(table + "distribution"),
        scene.need(table + "mean"),
        scene.get(table + "standard_deviation") or 0.0,
        scene.get(table + "truncation") or 2.0,
    )


def _grain_radius(scene: _Values) -> Iterator[Problem]:
    radii = _radii(scene)
    key = "sample.grain_radius.standard_deviation"
    if radii.name == "constant" and radii.standard_deviation > 0:
        yield Problem(key, "constant radii have no standard deviation")
    elif radii.name != "constant" and radii.standard_deviation == 0:
        yield Problem(key, f"a {radii.name} distribution needs one above zero")
    elif radii.smallest <= 0:
        yield Problem(key, f"too wide: the smallest radius would be {radii.smallest:g} m")


def _room(scene: _Values) -> Iterator[Problem]:
    largest_grain = _radii(scene).greatest
    room = find_radius_that_fits(_geometry(scene))
    if largest_grain > room:
        yield Problem(
            "sample.grain_radius.mean",
            f"radii up to {largest_grain:g} m do not fit: "
            f"the container takes radii up to {room:g} m",
        )


def _geometry(scene: _Values) -> Container:
    """The container; of a valid shape, without mirror planes given twice."""
    shape = scene.need("sample.container")
    planes = scene.get("sample.symmetry") or ()
    if shape == "box":
        sizes = {key: scene.need(f"sample.{key}") for key in ("size_x", "size_y")}
    else:
        sizes = {"radius": scene.need("sample.radius")}
    return Container(shape, tuple(dict.fromkeys(planes)), **sizes)


def _loading(scene: _Values) -> Iterator[Problem]:
    if not scene.has_table("loading"):
        return
    keys = {"sine": ("amplitude", "mean", "frequency"), "series": ("series",)}
    waveform = scene.need("loading.waveform")
    for owner, names in keys.items():
        for name in names:
            given = _present(scene, f"loading.{name}")
            if owner == waveform and not given:
                yield Problem(f"loading.{name}", f"missing: waveform {waveform!r} needs it")
            if owner != waveform and given:
                yield Problem(f"loading.{name}", f"waveform {waveform!r} does not use it")


def _no_tension(scene: _Values) -> Iterator[Problem]:
    trough = scene.need("loading.mean") - scene.need("loading.amplitude") / 2
    if trough < 0:
        yield Problem(
            "loading.mean",
            f"the stress would fall to mean - amplitude/2 = {trough:g} Pa: a piston can not pull",
        )


def _series(scene: _Values) -> Iterator[Problem]:
    try:
        read_load_series(Path(scene.need("loading.series")))
    except SceneError as error:
        yield Problem("loading.series", error.what, error.where)


def _partial_piston(scene: _Values) -> Iterator[Problem]:
    if scene.need("loading.area_share") < 1 and scene.need("sample.container") == "box":
        yield Problem("loading.area_share", "a piston on a part of the section needs a cylinder")


def _procedure(scene: _Values) -> Iterator[Problem]:
    if scene.has_table("procedure") and not scene.has_table("loading"):
        yield Problem("procedure", "there are no cycles without a loading table")
    first, total = scene.need("procedure.k_i"), scene.need("procedure.total_cycles")
    if total <= first:
        yield Problem("procedure.total_cycles", f"must exceed k_i = {first}, is {total}")


def _jumps(scene: _Values) -> Iterator[Problem]:
    """Either k and h, or a tolerance by which they choose themselves."""
    if not scene.has_table("procedure"):
        return
    given = [key for key in JUMP_KEYS if _present(scene, key)]
    if _present(scene, TOLERANCE_KEY):
        for key in given:
            name = key.rpartition(".")[2]
            yield Problem(key, f"with a tolerance {name} chooses itself: give one of the two")
    else:
        for key in JUMP_KEYS:
            if key not in given:
                yield Problem(key, "missing: give k and h, or a tolerance instead of both")


def _settlement(scene: _Values) -> Iterator[Problem]:
    if not scene.has_table("procedure") or scene.need("procedure.settlement") == "law":
        return
    key = "procedure.settlement"
    if _present(scene, TOLERANCE_KEY):
        yield Problem(key, "with a tolerance jumps forecast the settlement: leave this out")
    if scene.need("procedure.move") == "still":
        yield Problem(key, "move 'still' moves nothing, so no settlement: leave one of them out")


def _seating(scene: _Values) -> Iterator[Problem]:
    key = "procedure.seating_cycles"
    if _present(scene, key) and scene.get("procedure.seating") in (None, "any"):
        yield Problem(key, 'only a run that waits for its piston counts them: seating = "waits"')
    elif _present(scene, key) and scene.need(key) >= scene.need("procedure.total_cycles"):
        yield Problem(key, "with no fewer than total_cycles a run that waits never jumps")


def _jammed(scene: _Values) -> Iterator[Problem]:
    key = "procedure.jammed"
    if scene.get(key) in (None, "less"):
        return
    if _present(scene, TOLERANCE_KEY):
        yield Problem(key, "jumps with a tolerance move by what has room: leave this out")
    elif scene.get("procedure.settlement") in (None, "law"):
        yield Problem(
            key,
            "grains that change places settle by more or less than asked, which only the next jump "
            'by history makes good: settlement = "history", or leave this out',
        )
    if scene.get("procedure.relaxation") == "none":
        yield Problem(key, "without a relaxation no jump ever finds no room: leave this out")
    if scene.get("loading.area_share") not in (None, 1):
        yield Problem(
            key,
            "grains that change places flow without friction, up beside a piston on a part of the "
            "section: leave this out",
        )


def _launcher(scene: _Values) -> Iterator[Problem]:
    words = [Path(word).name for word in scene.get("engine.launcher") or ()]
    if scene.need("engine.name") == "yade" and set(words) & MPI_STARTERS:
        yield Problem(
            "engine.launcher", "YADE runs in one process: several would write the same files"
        )


def _engine(scene: _Values) -> Iterator[Problem]:
    name, known = scene.need("engine.name"), ("auto", *find_choices(AN_ENGINE, "ENGINE"))
    if name not in known:
        yield Problem("engine.name", f"unknown engine {name!r}{suggest_word(name, known)}")


def _law(scene: _Values) -> Iterator[Problem]:
    from adapters.laws import list_laws

    law, known = scene.need("procedure.law"), list_laws()
    if law not in known:
        yield Problem("procedure.law", f"unknown law {law!r}{suggest_word(law, known)}")


def _move(scene: _Values) -> Iterator[Problem]:
    from adapters.moves import RETIRED, list_moves

    move, known = scene.need("procedure.move"), list_moves()
    if move not in known:
        hint = tell_retired(move, RETIRED) or suggest_word(move, known)
        yield Problem("procedure.move", f"unknown way {move!r}{hint}")


def _relaxation(scene: _Values) -> Iterator[Problem]:
    method = scene.need("procedure.relaxation")
    if method not in ("smallest-move", "none"):  # what others ask loads the compiler
        from adapters.relaxation import METHODS, RETIRED

        if method not in METHODS:
            hint = tell_retired(method, RETIRED) or suggest_word(method, (*METHODS, "none"))
            yield Problem("procedure.relaxation", f"unknown relaxation {method!r}{hint}")


def _rayleigh_time(scene: _Values) -> float:
    grain = "material.grain."
    radii = _radii(scene)
    if radii.smallest <= 0:
        raise _NotValid
    return rayleigh_time(
        radii.smallest,
        scene.need(grain + "density"),
        scene.need(grain + "young"),
        scene.need(grain + "poisson"),
    )


def _rayleigh_share(scene: _Values) -> float:
    if scene.get("engine.time_step") is None:
        return float(scene.need("engine.rayleigh_share"))
    return float(scene.need("engine.time_step")) / _rayleigh_time(scene)


def _time_step(scene: _Values) -> Iterator[Problem]:
    share = _rayleigh_share(scene)
    if share > 1:
        yield Problem(
            "engine.time_step",
            f"{share:.3g} Rayleigh times of the smallest grain "
            f"({_rayleigh_time(scene):.3g} s): the grains would explode",
        )


def _fill_height(scene: _Values) -> Iterator[Problem]:
    height = scene.need("sample.fill_height")
    count = expect_grain_count(_radii(scene), _geometry(scene), height)
    if not 1 <= count <= COUNT_GREATEST:
        yield Problem("sample.fill_height", f"{height:g} m would take {count:.3g} grains")


def _overlap_share(scene: _Values) -> tuple[str, float, float]:
    """Key of the load, its greatest stress [Pa], mean overlap under it over the smallest radius.

    A grain of a layer carries the stress on the square that it fills, (2 r)^2.
    """
    if scene.need("loading.waveform") == "sine":
        key = "loading.amplitude"
        stress = scene.need("loading.mean") + scene.need(key) / 2
    else:
        key = "loading.series"
        try:
            series = read_load_series(Path(scene.need(key)))
        except SceneError as error:
            raise _NotValid from error
        stress = float(series.stress.max())
    radii, grain = _radii(scene), "material.grain."
    if radii.smallest <= 0:
        raise _NotValid
    young, poisson = scene.need(grain + "young"), scene.need(grain + "poisson")
    modulus = equivalent_modulus(young, poisson, young, poisson)
    overlap = overlap_under_force(stress * (2 * radii.mean) ** 2, modulus, radii.mean / 2)
    return key, stress, float(overlap) / radii.smallest


def _great_load(scene: _Values) -> Iterator[Problem]:
    key, stress, share = _overlap_share(scene)
    if share > OVERLAP_BOUND:
        yield Problem(
            key,
            f"a stress of {stress:.3g} Pa presses grains {share:.2g} of the smallest radius into "
            f"one another; Hertz contact is a law up to {OVERLAP_BOUND:g}: "
            "a smaller load, or stiffer grains",
        )


CHECKS: tuple[Check, ...] = (
    _alternatives,
    _container,
    _symmetry,
    _grain_radius,
    _room,
    _fill_height,
    _loading,
    _no_tension,
    _series,
    _partial_piston,
    _procedure,
    _jumps,
    _settlement,
    _seating,
    _jammed,
    _launcher,
    _engine,
    _law,
    _move,
    _relaxation,
    _time_step,
    _great_load,
)


def _long_time_step(scene: _Values) -> Iterator[Problem]:
    share = _rayleigh_share(scene)
    if RAYLEIGH_SHARE_DOUBTFUL < share <= 1:
        key = "rayleigh_share" if scene.get("engine.time_step") is None else "time_step"
        yield Problem(
            f"engine.{key}",
            f"{share:.2g} of the Rayleigh time; above {RAYLEIGH_SHARE_DOUBTFUL} collisions "
            "gain energy and settlement is doubtful",
        )


def _narrow(scene: _Values) -> Iterator[Problem]:
    container = _geometry(scene)
    is_box = container.shape == "box"
    width = min(container.size_x, container.size_y) if is_box else 2 * container.radius
    ratio = width / (2 * scene.need("sample.grain_radius.mean"))
    if ratio < WIDTH_DOUBTFUL:
        yield Problem(
            "sample.grain_radius.mean",
            f"the container is {ratio:.2g} mean grain diameters wide: walls rule the result",
        )


def _few_steps(scene: _Values) -> Iterator[Problem]:
    if scene.get("engine.time_step") is None:
        longest = scene.need("engine.rayleigh_share") * _rayleigh_time(scene)
    else:
        longest = scene.need("engine.time_step")
    frequency = scene.need("loading.frequency")
    steps = 1 / (frequency * longest)
    if steps < STEPS_DOUBTFUL:
        yield Problem("loading.frequency", f"a cycle is only {steps:.3g} time steps long")


def _deep_chains(scene: _Values) -> Iterator[Problem]:
    key, stress, share = _overlap_share(scene)
    deepest = CHAIN_FACTOR ** (2 / 3) * share
    if deepest > OVERLAP_BOUND:
        yield Problem(
            key,
            f"under {stress:.3g} Pa overlaps reach about {deepest:.2g} of the smallest radius in "
            f"force chains; above {OVERLAP_BOUND:g} a run is refused",
        )


def _far_jump(scene: _Values) -> Iterator[Problem]:
    if scene.get("procedure.settlement") == "history":  # by all cycles computed so far
        return
    h, k = max(scene.need("procedure.h")), scene.need("procedure.k")
    if h > JUMP_DOUBTFUL * k:
        yield Problem(
            "procedure.h",
            f"a jump of {h} cycles is fitted to {k}: above {JUMP_DOUBTFUL} times as many it "
            "extrapolates their noise, and the bed may even rise",
        )


DOUBTS: tuple[Check, ...] = (_long_time_step, _narrow, _few_steps, _deep_chains, _far_jump)


def find_problems(values: Mapping[str, Any], invalid: Iterable[str] = ()) -> list[Problem]:
    """All that is wrong between the keys of a scene.

    ``values`` by dotted key, defaults included; ``invalid`` names keys and tables that are not
    valid in themselves.
    """
    return _found(CHECKS, _Values(values, invalid))


def find_warnings(values: Mapping[str, Any]) -> list[Problem]:
    """All that is doubtful in a valid scene; ``values`` by dotted key, defaults included."""
    return _found(DOUBTS, _Values(values, ()))


def _found(checks: Iterable[Check], scene: _Values) -> list[Problem]:
    problems: list[Problem] = []
    for check in checks:
        try:
            problems.extend(check(scene))
        except _NotValid:
            continue
    return problems
