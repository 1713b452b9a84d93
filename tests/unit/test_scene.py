"""The scene file: what it means, and that every wrong one is answered with lines and keys."""

from __future__ import annotations

import json
import re
from math import inf, pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.engines.contract import get_engine, list_engines, list_real_engines
from adapters.errors import SceneError
from adapters.files.load_series import read_load_series
from adapters.scene.bearing import count_layers, warn_of_bed
from adapters.scene.file import load_scene
from adapters.scene.procedures import schedule_jumps
from adapters.scene.tables import Loading, Procedure, Scene
from qdem_fem.tables.keys import Scene as QdemScene
from qdem_fem.track.table import TrackTable
from track_line.scene.file import SceneTables as LineTables
from trackbed.scene_files.types import Table
from trackbed.scenes import find_scene_file, find_scene_verb, list_scenes, read_template

pytestmark = pytest.mark.lowest

KARRECH = read_template("karrech")


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def with_value(text: str, key: str, statement: str) -> tuple[str, int]:
    """The text with the statement of a dotted key replaced, and its line number."""
    *tables, name = key.split(".")
    header, table = f"[{'.'.join(tables)}]", ""
    lines = text.split("\n")
    for index, line in enumerate(lines):
        if line.startswith("["):
            table = line.split("]")[0] + "]"
        if table == header and line.startswith(f"{name} ="):
            lines[index] = statement
            return "\n".join(lines), index + 1
    raise AssertionError(f"no key {key}")


def series_scene(folder: Path, rows: str) -> Path:
    (folder / "load.csv").write_text(rows)
    text = KARRECH
    for key in ("amplitude", "mean", "frequency"):
        text, _ = with_value(text, f"loading.{key}", "")
    text, _ = with_value(text, "loading.waveform", 'waveform = "series"\nseries = "load.csv"')
    return write(folder, text)


def refusal(folder: Path, text: str, overrides: list[str] | None = None) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(write(folder, text), overrides or [])
    return str(caught.value)


# ---------------------------------------------------------------------------- what a scene means


def test_shipped_scenes_load_without_doubts() -> None:
    """Every scene that ships is valid and free of warnings, on whichever engine there is."""
    names = [name for name in list_scenes() if find_scene_verb(name) == "run"]
    assert names == ["ballast", "cluster", "karrech", "karrech-coarse", "karrech-partial"]
    for name in names:
        scene = load_scene(Path(__file__).parents[2] / "trackbed" / "scenes" / f"{name}.toml")
        assert (*scene.warnings, *warn_of_bed(scene)) == ()
        assert scene.engine.name == "auto"
    with pytest.raises(KeyError, match="karrech-coarse"):
        read_template("carrech")


def test_new_names_the_verb_that_reads_the_scene() -> None:
    """`trackbed new` says which verb goes on: that whose reader takes the scene."""
    from qdem_fem.scene.checks import GUIDE, read_scene
    from rigid_lcp.scene.file import load_scene as rigid_scene
    from track_line.scene import load_scene as line_scene

    def check_qdem(path: Path) -> None:
        read_scene(path, guide=GUIDE).check(QdemScene)

    readers = {"run": load_scene, "qdem": check_qdem, "rigid": rigid_scene, "line": line_scene}
    for name in list_scenes():
        readers[find_scene_verb(name)](find_scene_file(name))


def test_shipped_scenes_are_what_they_say(tmp_path: Path) -> None:
    """karrech.toml is the paper's Table 1 and its load; the piston of karrech-partial.toml has
    80 % of the section, 5.87 kPa at 10 Hz; karrech-coarse.toml presses with 10 N at the crest."""
    scene = load_scene(write(tmp_path, KARRECH))
    grain = scene.material.grain
    assert (grain.young, grain.poisson, grain.density) == (46.9e9, 0.25, 2710)
    assert (grain.friction, grain.viscous_alpha) == (0.5, 0.44)
    assert (scene.sample.radius, scene.sample.radii.mean) == (0.075, 3.2e-3)
    assert scene.container.area == pytest.approx(pi * 0.075**2 / 4, rel=1e-15)
    assert scene.piston_reach == inf
    assert float(scene.stress_at(0.5) - scene.stress_at(0)) == pytest.approx(14150, rel=1e-14)
    assert scene.restitution == pytest.approx(0.2145, abs=5e-5)
    part = load_scene(find_scene_file("karrech-partial"))
    assert pi * part.piston_reach**2 / 4 == pytest.approx(part.loaded_area, rel=1e-14)
    assert part.loaded_area == pytest.approx(0.8 * part.container.area, rel=1e-14)
    assert part.loading is not None
    assert (part.loading.amplitude, part.loading.period) == (5870, 0.1)
    coarse = load_scene(find_scene_file("karrech-coarse"))
    assert float(coarse.stress_at(0.5)) * coarse.loaded_area == pytest.approx(10.0, rel=1e-3)
    assert float(coarse.stress_at(3.0)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (Scene, ["karrech", "ballast"]),
        (QdemScene, ["cantilever"]),
        (TrackTable, ["cantilever", "track-small"]),
        (LineTables, ["line"]),
    ],
)
def test_every_key_of_the_models_is_explained(model: type[Table], names: list[str]) -> None:
    """The shipped scenes that specify a format name every key of its models."""
    schema, text = model.model_json_schema(), "".join(map(read_template, names))
    keys = {key for table in (schema, *schema["$defs"].values()) for key in table["properties"]}
    assert [key for key in keys if not re.search(rf"\b{key}\b", text)] == []


def test_engine_names_agree() -> None:
    """Every file with an engine is known by its name; ``auto`` asks those with mechanics only."""
    assert [get_engine(name).name for name in list_engines()] == list(list_engines())
    assert list_real_engines() == ("liggghts", "lammps", "yade")
    assert set(list_engines()) - set(list_real_engines()) == {"fake"}


@settings(max_examples=60)
@given(
    frequency=st.floats(0.01, 1000),
    share=st.floats(0.05, 1),
    samples=st.integers(2, 40) | st.none(),
)
def test_period_is_whole_steps(
    tmp_path_factory: pytest.TempPathFactory, frequency: float, share: float, samples: int | None
) -> None:
    """The time step divides the period, a series' interval and the piston's sampling interval.

    It is the longest such step that the share allows.
    """
    folder = tmp_path_factory.mktemp("scene")
    overrides = [f"engine.rayleigh_share={share!r}", f"loading.frequency={frequency!r}"]
    if samples is None:
        path = write(folder, KARRECH)
    else:
        times = np.arange(samples + 1) / (frequency * samples)
        rows = "\n".join(f"{t!r},{1e3 * (i % samples)}" for i, t in enumerate(times.tolist()))
        path = series_scene(folder, f"time,stress\n{rows}\n")
        overrides = overrides[:1]
    scene = load_scene(path, overrides)
    limit = share * scene.rayleigh_time
    intervals, steps = scene.samples_per_cycle, scene.steps_per_cycle
    assert intervals % (samples or 1) == 0
    assert steps % intervals == 0
    assert steps * scene.time_step == pytest.approx(1 / frequency, rel=1e-9)
    assert scene.time_step <= limit * (1 + 1e-9)
    longer = 1 / frequency / (steps - intervals) if steps > intervals else inf
    assert longer > limit * (1 - 1e-9)


def test_unloaded_scene(tmp_path: Path) -> None:
    """A scene may leave out loading and procedure: no stress, no area, the longest time step."""
    text = KARRECH[: KARRECH.index("[loading]")] + KARRECH[KARRECH.index("[engine]") :]
    scene = load_scene(write(tmp_path, text))
    assert scene.loading is None
    assert (scene.loaded_area, scene.piston_reach, scene.steps_per_cycle) == (0, inf, 0)
    assert scene.time_step == pytest.approx(0.2 * scene.rayleigh_time)
    assert scene.stress_at(np.array([0.0, 0.3])).tolist() == [0, 0]


@given(phase=st.floats(-50, 50))
def test_sine_stress(phase: float) -> None:
    """stress = mean - amplitude/2 cos(2 pi phase): periodic, even, its mean over antiphases."""
    loading = Loading(amplitude=1000.0, mean=500.0, frequency=5.0, piston_mass=0.1)
    stress = float(loading.stress_at(phase))
    assert stress >= -1e-9
    assert stress == pytest.approx(float(loading.stress_at(-phase)), abs=1e-8)
    assert stress + float(loading.stress_at(phase + 0.5)) == pytest.approx(2 * 500, abs=1e-8)


def test_fill_height_gives_the_count(tmp_path: Path) -> None:
    """``fill_height`` alone fixes the count, through relative density 0.5615 and mean volume."""
    scene = load_scene(write(tmp_path, KARRECH), ["sample.fill_height=0.06"])
    assert scene.sample.count is None
    grains = scene.grain_count * scene.sample.radii.volume_mean
    assert grains / (scene.container.area * 0.06) == pytest.approx(0.5615, rel=1e-3)


def test_schedule_of_jumps(tmp_path: Path) -> None:
    """A schedule's last entry repeats; a bare number is a schedule of one; h = "3 growing" are the
    lengths of `schedule_jumps`, which a manifest keeps as numbers."""

    def procedure(*keys: str) -> Procedure:
        found = load_scene(write(tmp_path, KARRECH), keys).procedure
        assert found is not None
        return found

    assert [procedure("procedure.h=[5, 10]").jump_cycles(i) for i in range(4)] == [5, 10, 10, 10]
    assert procedure("procedure.h=0").h == (0,)
    keys = ["procedure.k_i=40", "procedure.k=10", "procedure.total_cycles=500"]
    for words in ('"3 growing"', "3 growing", '"3 growing jumps"'):
        found = procedure(*keys, f"procedure.h={words}")
        assert found.h == tuple(schedule_jumps(3, 500, 40, 10, found.healing_cycles))
    text, _ = with_value(KARRECH, "procedure.h", 'h = "2 growing"')
    wrong, _ = with_value(text, "procedure.k", "k = 1")
    message = refusal(tmp_path, wrong)  # what is wrong with the other keys is said, and only that
    assert "procedure.k: " in message
    assert "procedure.h: " not in message


def test_scene_survives_json(tmp_path: Path) -> None:
    """What a manifest stores gives back the same scene; the demands between keys hold for scenes
    that come from no file, too."""
    scene = load_scene(write(tmp_path, KARRECH))
    stored = json.loads(scene.model_dump_json(exclude_none=True))
    assert Scene.model_validate(stored) == scene
    stored["loading"]["mean"] = 0.0
    with pytest.raises(ValueError, match="a piston can not pull"):
        Scene.model_validate(stored)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("engine.rayleigh_share=0.5", "0.5 of the Rayleigh time"),
        ("engine.time_step=1.5e-6", "0.56 of the Rayleigh time"),
        ("sample.radius=0.02", "mean grain diameters wide"),
        ("loading.frequency=50000.0", "time steps long"),
        ("procedure.h=1000", "a jump of 1000 cycles is fitted to 20"),
        ("material.grain.friction=1.2", "may stick between large ones above 1.78"),
        ("material.grain.friction=30", "as an angle in degrees it would be 0.5774"),
        ("material.grain.density=2.71", "as g/cm^3 it would be 2710 kg/m^3"),
        ("material.grain.young=1e8", "in force chains; above 0.05 a run is refused"),
    ],
)
def test_doubts_are_warnings(tmp_path: Path, override: str, words: str) -> None:
    """What is allowed but doubtful is said, once, and is no error.  A jump by history is not fitted
    to its window alone: its length is no doubt."""
    said = load_scene(write(tmp_path, KARRECH), [override]).warnings
    (warning,) = said if "friction=30" not in override else said[:1]  # a wedge holds at 30, too
    assert words in warning
    history = [override, 'procedure.settlement="history"']
    warnings = load_scene(write(tmp_path, KARRECH), history).warnings
    assert len(said) - len(warnings) == ("procedure.h" in override)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("sample.radius=20.0", "sample: the grains make 0.00014 of a layer"),
        ("material.wall.young=210e3", "material.wall.young: grains enter walls"),
        ("loading.piston_mass=5000.0", "loading.piston_mass: it swings on its bed at most 0.18"),
    ],
)
def test_what_hardly_bears_is_said(tmp_path: Path, override: str, words: str) -> None:
    """By each key alone; 1,085 grains of 3.2 mm make 4 N r^2/(pi R^2/4) layers."""
    scene = load_scene(write(tmp_path, KARRECH), [override])
    said = list(warn_of_bed(scene))
    assert any(words in one for one in said), said
    thin = 1085 * (2 * 3.2e-3) ** 2 / (np.pi * 20.0**2 / 4)
    assert "radius" not in override or count_layers(scene) == pytest.approx(thin)


# ---------------------------------------------------------------------------- what is refused

REFUSED = [
    ("sample.container", 'container = "cylindre"', "did you mean cylinder?"),
    ("sample.radius", "radius = -0.075", "at least"),
    ("sample.radius", "", "a cylinder has a radius"),
    ("sample.radius", "radius = 0.01", "do not fit"),
    ("sample.container", 'container = "box"', "a box has a size_x"),
    ("sample.symmetry", 'symmetry = ["x", "z"]', "must be 'x' or 'y'"),
    ("sample.symmetry", 'symmetry = ["x", "x"]', "only once"),
    ("sample.count", "count = 0", "at least 1"),
    ("sample.count", "count = 10.5", "integer"),
    ("sample.count", "", "give this or fill_height"),
    ("sample.count", "count = 9\nfill_height = 0.05", "not both"),
    ("sample.count", "fill_height = 1e-5", "would take 0 grains"),
    ("sample.relative_density_start", "relative_density_start = 0.5", "at most 0.15"),
    ("sample.seed", "seed = -1", "at least 0"),
    ("sample.grain_radius.mean", "mean = nan", "finite"),
    ("sample.grain_radius.standard_deviation", "standard_deviation = 2e-3", "smallest radius"),
    ("sample.grain_radius.standard_deviation", "", "needs one above zero"),
    ("sample.grain_radius.distribution", 'distribution = "constant"', "no standard deviation"),
    ("material.grain.young", "young = true", "number"),
    ("material.grain.young", 'young = "46.9e9"', "number"),
    ("material.grain.poisson", "poisson = 0.5", "below 0.5"),
    ("material.grain.viscous_alpha", "viscous_alpha = 0.7", "below 0.690"),
    ("material.grain.viscous_alpha", "restitution = 0.05", "above 0.05"),
    ("material.grain.viscous_alpha", "viscous_alpha = 0.2\nrestitution = 0.5", "not both"),
    ("material.grain.friction", "friction = -0.1", "at least 0"),
    ("material.wall.young", "", "missing"),
    ("loading.waveform", 'waveform = "series"', "does not use it"),
    ("loading.amplitude", "", "needs it"),
    ("loading.mean", "mean = 1e9", "of the smallest radius into one another"),
    ("loading.mean", "mean = 7000.0", "a piston can not pull"),
    ("loading.area_share", "area_share = 1.2", "at most 1"),
    ("loading.piston_mass", "piston_mass = 0", "at least"),
    ("procedure.k_i", "k_i = 0", "at least 1"),
    ("procedure.k", "k = 1", "at least 2"),
    ("procedure.h", "h = -1", "at least 0"),
    ("procedure.h", "h = []", "at least 1 entries"),
    ("procedure.h", "h = [20, 2.5]", "integer"),
    ("procedure.h", 'h = "five growing"', 'as "5 growing"'),
    ("procedure.h", 'h = "0 growing"', 'as "5 growing"'),
    ("procedure.h", 'h = "900 growing"', "leave the first no cycle"),
    ("procedure.healing_cycles", "healing_cycles = -1", "at least 0"),
    ("procedure.law", 'law = "lug"', "did you mean log?"),
    ("procedure.move", 'move = "smooth"', "did you mean smoothed?"),
    ("procedure.move", 'move = "shrunk"', "0.1 is the last to have it; use 'smoothed'"),
    ("procedure.relaxation", 'relaxation = "proximal"', "to have it; use 'smallest-move'"),
    ("procedure.settlement", 'settlement = "past"', "'law' or 'history'"),
    ("procedure.jammed", 'jammed = "rearranged"', "'less'"),
    ("procedure.relaxation", 'relaxation = "smallest move"', "did you mean smallest-move?"),
    ("procedure.total_cycles", "total_cycles = 1", "must exceed k_i ="),
    ("engine.name", 'name = "ligghts"', "did you mean liggghts?"),
    ("engine.name", 'name = "pfc"', "known: auto, fake, lammps, liggghts, yade"),
    ("engine.rayleigh_share", "rayleigh_share = 1.1", "at most 1"),
    ("engine.rayleigh_share", "time_step = 1.0", "Rayleigh times"),
    ("engine.launcher", 'launcher = "mpirun"', "must be a list"),
    ("engine.launcher", 'launcher = ["mpirun", ""]', "must not be empty"),
]


@pytest.mark.parametrize(("key", "statement", "words"), REFUSED)
def test_wrong_value_is_refused_with_its_place(
    tmp_path: Path, key: str, statement: str, words: str
) -> None:
    """Each wrong value is named by file, a line of its table, its table, and a sentence."""
    text, line = with_value(KARRECH, key, statement)
    message = refusal(tmp_path, text)
    table = key.rpartition(".")[0]
    (entry, *_) = [entry for entry in message.split("\n") if words in entry]
    found = re.match(rf"  {re.escape(str(tmp_path))}/scene\.toml:(\d+): ([\w.]+): ", entry)
    assert found
    assert found[2].startswith(table)
    if found[2] == key and statement:
        assert int(found[1]) == line


SAFE_TO_COMBINE = [
    ("sample.seed", "seed = 1.5"),
    ("sample.grain_radius.truncation", "truncation = -2"),
    ("material.grain.poisson", "poisson = 0.7"),
    ("material.grain.friction", 'friction = "0.5"'),
    ("material.wall.poisson", "poisson = inf"),
    ("loading.mean", "mean = 1.0"),
    ("loading.area_share", "area_share = 0.0"),
    ("procedure.k", "k = true"),
    ("procedure.total_cycles", "total_cycles = 3"),
    ("engine.launcher", "launcher = [1]"),
    ("engine.rayleigh_share", "rayleigh_share = 2"),
]


@settings(max_examples=60)
@given(chosen=st.lists(st.sampled_from(SAFE_TO_COMBINE), min_size=1, unique=True))
def test_all_problems_at_once(tmp_path_factory, chosen: list[tuple[str, str]]) -> None:
    """Any set of wrong keys is reported whole, each at its own line, and nothing else."""
    folder = tmp_path_factory.mktemp("scene")
    text, expected = KARRECH, set()
    for key, statement in chosen:
        text, line = with_value(text, key, statement)
        expected.add((line, key))
    message = refusal(folder, text)
    found = re.findall(r"scene\.toml:(\d+): ([\w.]+): ", message)
    assert {(int(line), key.removesuffix(".0")) for line, key in found} == expected
    assert len(found) == len(expected)
    assert [int(line) for line, _ in found] == sorted(int(line) for line, _ in found)


@pytest.mark.parametrize(
    "table", ["sample", "sample.grain_radius", "material", "material.grain", "loading", "engine"]
)
def test_value_in_place_of_a_table(tmp_path: Path, table: str) -> None:
    """A table that is a value is one problem: nothing is said about the keys it can not have."""
    message = refusal(tmp_path, KARRECH, [f"{table}=3"])
    assert message.startswith(f"{tmp_path}/scene.toml: 1 problem\n")
    assert f"--set {table}=3: {table}: must be a table, not 3" in message


# ---------------------------------------------------------------------------- overrides


def test_override_of_an_alternative_replaces_the_other(tmp_path: Path) -> None:
    """Setting one of two alternative keys removes the other of the file.  A time step that divides
    the period already, 0.02 s/5e-7 s = 40,000, is not shortened."""
    path = write(tmp_path, KARRECH)
    scene = load_scene(path, ["material.grain.restitution=0.5", "engine.time_step=5e-7"])
    assert scene.restitution == 0.5
    assert scene.steps_per_cycle == 40_000
    assert scene.time_step == pytest.approx(5e-7, rel=1e-12)
    assert scene.material.grain.viscous_alpha is None
    assert scene.engine.rayleigh_share is None


# ---------------------------------------------------------------------------- load series


def test_series_is_read_beside_the_scene(tmp_path: Path) -> None:
    """A series is found beside its scene, linear between samples, and periodic."""
    path = series_scene(tmp_path, "time,stress\n0.5,0\n0.6,100\n0.7,300\n0.8,200\n0.9,0\n")
    scene = load_scene(path)
    assert scene.loading is not None
    assert scene.loading.period == pytest.approx(0.4)
    assert scene.stress_at(np.array([0, 0.25, 0.375, 0.5, 1.25, -0.25])).tolist() == pytest.approx(
        [0, 100, 200, 300, 100, 200]
    )


@pytest.mark.parametrize(
    ("rows", "line", "words"),
    [
        ("t,s\n0,0\n1,1\n2,0\n", 1, "there is no column time"),
        ("time,stress\n0,0\n1,0\n", None, "at least three rows"),
        ("time,stress\n0,0\n1,nan\n2,0\n", 3, "finite"),
        ("time,stress\n0,0\n1,-5\n2,0\n", 3, "can not pull"),
        ("time,stress\n0,0\n\n1,5\n2.1,6\n3,0\n", 5, "even steps"),
        ("time,stress\n0,0\n1,5\n1,6\n3,0\n", 4, "even steps"),
        ("time,stress\n0,0\n1,5\n2,5\n4,6\n5,0\n", 5, "even steps"),
        ("time,stress\n0,0\n-1,5\n-2,0\n", 3, "even steps"),
        ("time,stress\n0,1\n1,5\n2,2\n", 4, "must be the first"),
    ],
)
def test_wrong_series_is_refused_with_its_line(
    tmp_path: Path, rows: str, line: int | None, words: str
) -> None:
    """A series is refused with its own file and line, beside the scene's other problems."""
    path = series_scene(tmp_path, rows)
    text, bad_line = with_value(path.read_text(), "procedure.k", "k = 0")
    message = refusal(tmp_path, text)
    where = f"{tmp_path}/load.csv" + (f":{line}" if line else "")
    assert re.search(
        rf"  {re.escape(where)}(:\d+)?(, column \w+)?: loading.series: .*{words}", message
    )
    assert f"scene.toml:{bad_line}: procedure.k" in message
    (tmp_path / "load.csv").unlink()
    assert f"{tmp_path}/load.csv: loading.series: can not read" in refusal(tmp_path, text)


@settings(max_examples=40)
@given(stress=st.lists(st.floats(0, 1e6), min_size=2, max_size=30), step=st.floats(1e-6, 10))
def test_series_returns_what_was_written(
    tmp_path_factory: pytest.TempPathFactory, stress: list[float], step: float
) -> None:
    """Every even, periodic series is read without loss, and its samples are its stresses."""
    path = tmp_path_factory.mktemp("series") / "load.csv"
    stress = [*stress, stress[0]]
    path.write_text(
        "time,stress\n" + "\n".join(f"{i * step!r},{s!r}" for i, s in enumerate(stress))
    )
    series = read_load_series(path)
    assert series.stress.tolist() == stress
    assert series.period == pytest.approx((len(stress) - 1) * step)
    phase = np.arange(len(stress)) / (len(stress) - 1)
    assert series.stress_at(phase) == pytest.approx(stress, rel=1e-9, abs=1e-6)
