"""The members of a sweep: values, names, seeds, and what is refused before anything starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.errors import EngineMissing, SceneError, UsageError
from adapters.procedure.members import estimate_mean
from adapters.procedure.sweep.cluster import check_libraries
from adapters.procedure.sweep.member import read_sentence
from adapters.procedure.sweep.plan import NAME_LONGEST, name_member, plan_sweep, split_values
from tests.small_bed import small_bed


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene file of the small bed."""
    path = tmp_path / "scene.toml"
    path.write_text(small_bed(k=2, h=2, total_cycles=10))
    return path


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("10,20,50", ["10", "20", "50"]),
        ("lammps, yade", ["lammps", "yade"]),
        ("[60, 30],[20]", ["[60, 30]", "[20]"]),
        ('["mpirun","-np"], []', ['["mpirun","-np"]', "[]"]),
        ("\"a,b\",'c]'", ['"a,b"', "'c]'"]),
        *((text, None) for text in ("", "10,", ",10", "10,,20", "10,10")),
    ],
)
def test_values_between_commas(text: str, values: list[str] | None) -> None:
    """Commas inside brackets and quotes part nothing; an empty value, or one given twice, is
    refused."""
    if values is None:
        with pytest.raises(UsageError, match=r"empty|twice"):
            split_values(text)
    else:
        assert split_values(text) == values


def test_members_are_the_product(scene: Path, tmp_path: Path) -> None:
    """Two keys with two values each and three seeds: twelve members, four groups of three."""
    words = ["loading.frequency=10,20", "procedure.h=[1, 2],2"]
    sweep = plan_sweep(scene, tmp_path / "sweep", words, 3, ["loading.mean=8000"])
    assert len(sweep.members) == 12
    assert [len(members) for members in sweep.groups().values()] == [3, 3, 3, 3]
    assert {member.seed for member in sweep.members} == {1, 2, 3}
    found = {(m.scene.loading.frequency, m.scene.procedure.h) for m in sweep.members}
    assert found == {(10.0, (1, 2)), (10.0, (2,)), (20.0, (1, 2)), (20.0, (2,))}
    assert {member.scene.loading.mean for member in sweep.members} == {8000.0}
    assert len({member.name for member in sweep.members}) == 12


def test_groups_are_told_by_what_differs(scene: Path, tmp_path: Path) -> None:
    """A key with one value is part of a member's folder, and of no label.  A sweep with more values
    and seeds has the members of the smaller one, by the same names."""
    sweep = plan_sweep(scene, tmp_path, ["procedure.k=3", "loading.frequency=10,20"], 2)
    large = plan_sweep(scene, tmp_path, ["procedure.k=3", "loading.frequency=30,20,10"], 4)
    assert {m.name for m in sweep.members} < {m.name for m in large.members}
    assert list(sweep.groups()) == ["loading.frequency=10", "loading.frequency=20"]
    assert sweep.members[0].name == "procedure.k=3,loading.frequency=10,sample.seed=1"
    assert list(plan_sweep(scene, tmp_path, ["procedure.k=3"], 2).groups()) == ["the scene"]


def test_seeds_count_from_the_scene(scene: Path, tmp_path: Path) -> None:
    """Seeds count up from the scene's; given as values they are those; one by default."""

    def seeds(words: list[str], count: int | None) -> list[int]:
        return [m.seed for m in plan_sweep(scene, tmp_path / "s", words, count).members]

    scene.write_text(scene.read_text().replace("count = 60", "count = 60\nseed = 40"))
    assert seeds([], 3) == [40, 41, 42]
    assert seeds(["sample.seed=7,3"], None) == [7, 3]
    assert seeds([], None) == [40]
    with pytest.raises(UsageError, match="--seeds sets"):
        seeds(["sample.seed=7,3"], 2)
    with pytest.raises(UsageError, match="1 to 10000 seeds"):
        seeds([], 0)


@given(st.text(min_size=1, max_size=300), st.text(min_size=1, max_size=300))
def test_names_are_folders_and_differ(first: str, second: str) -> None:
    """Any value makes a plain folder name, and two values never the same one."""
    names = [name_member({"a.b": value}, 1) for value in (first, second)]
    for name in names:
        assert "/" not in name
        assert "\0" not in name
        assert len(name) <= NAME_LONGEST + 9
    assert (names[0] == names[1]) == (first == second)


@pytest.mark.parametrize(
    ("words", "error", "sentence"),
    [
        (["loading.frequency=10,fast"], SceneError, "loading.frequency=fast"),
        (["loading.frequenzy=10,20"], SceneError, "frequenzy"),
        (["loading.amplitude=1e4,3e4"], SceneError, "can not pull"),
        (["loading.frequency=10,10.0"], UsageError, "are the same scene"),
        (["loading.frequency=10", "loading.frequency=20"], UsageError, "given twice"),
        (["loading.frequency"], UsageError, "cannot read"),
        (["=10"], UsageError, "cannot read"),
    ],
)
def test_wrong_values_are_refused_before_anything_starts(
    scene: Path, tmp_path: Path, words: list[str], error: type[Exception], sentence: str
) -> None:
    """Every member's scene is checked first, and the message names the value."""
    with pytest.raises(error, match=sentence):
        plan_sweep(scene, tmp_path / "sweep", words, 2)
    assert not (tmp_path / "sweep").exists()


def test_a_scene_without_load_is_no_sweep(scene: Path, tmp_path: Path) -> None:
    """Settlements are what a sweep compares."""
    text = scene.read_text()
    scene.write_text(text.partition("[loading]")[0] + "[engine]" + text.partition("[engine]")[2])
    with pytest.raises(SceneError, match="no load cycles"):
        plan_sweep(scene, tmp_path / "sweep", [], 2)


def test_what_a_member_said(tmp_path: Path) -> None:
    """The last error sentence with its remedy; without one the signal, or the last words."""
    screen = tmp_path / "screen.txt"
    screen.write_text("rain of grains\ntrackbed: x.toml: no engine\n  -> install one\n")
    assert read_sentence(4, screen) == "x.toml: no engine\n  -> install one"
    assert read_sentence(0, screen) == ""
    screen.write_text("rain of grains\n")
    assert read_sentence(-9, screen) == "the run was ended by SIGKILL"
    assert read_sentence(1, screen) == "the run ended with exit code 1: rain of grains"


@pytest.mark.parametrize("missing", ["distributed", "dask_jobqueue"])
def test_a_missing_library_is_named_before_anything_starts(missing: str, monkeypatch) -> None:
    """Exit code 4 and how to get it; on this machine none is needed, dask-jobqueue by SLURM."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == missing else 1)
    with pytest.raises(EngineMissing, match=rf"{missing}\n.*trackbed\[sweep\]"):
        check_libraries("slurm")
    check_libraries("local")
    if missing == "dask_jobqueue":
        check_libraries("tcp://node1:8786")


def test_band_is_students() -> None:
    """Half width t_(n-1) s/sqrt(n): for 1, 2, 3 it is 4.302653 times 1/sqrt(3), one has none; of
    2,000 samples of five the 95 % band misses the mean in 5 %, give or take 1.5."""
    mean, half = estimate_mean(np.array([[1.0], [2.0], [3.0]]), 0.95)
    assert mean == pytest.approx([2.0])
    assert half == pytest.approx([4.30265273 / 3**0.5], rel=1e-8)
    assert np.isnan(estimate_mean(np.array([[1.0]]), 0.95)[1]).all()
    samples = np.random.default_rng(5).normal(3.0, 2.0, size=(5, 2000))
    mean, half = estimate_mean(samples, 0.95)
    assert np.mean(np.abs(mean - 3.0) > half) == pytest.approx(0.05, abs=0.015)
