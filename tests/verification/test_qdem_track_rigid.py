"""A track whose grains are rigid in the run: its first forces, and what it leaves out."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import pytest

from qdem_fem.files.errors import SceneError, StepWarning
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from qdem_fem.track import bearing
from qdem_fem.track.bearing import begin_bed
from qdem_fem.track.bed import prepare_bed, read_bed
from qdem_fem.track.enter import TrackPrepared, choose_contact
from validation.bench.track_trials import SCENE, load_track

FEW = ("track.below=8", "track.beside=3", "track.unbalanced=0.5")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene of eleven grains beside its prepared bed."""
    made = tmp_path_factory.mktemp("rigid")
    prepared = load_track(made, *FEW)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # of stages whose contacts are few
        prepare_bed(prepared.recipe, prepared.bed_file, 1)
    return made


def prepared_in(folder: Path, *overrides: str) -> TrackPrepared:
    return load_track(folder, *FEW, *overrides)


@pytest.mark.long
def test_rigid_grains_begin_with_the_forces_of_deformable_ones(folder: Path) -> None:
    """To the bit: they lie where those lay.  The sleeper keeps its strain, grains have none."""
    prepared = prepared_in(folder)
    bed, contact = read_bed(prepared.bed_file, prepared.recipe), choose_contact(prepared)
    runs = [begin_bed(prepared.recipe, bed, contact, kind, threads=1)[0] for kind in (False, True)]
    for run in runs:
        assert run.contacts is not None
        run.contacts.refresh()
    soft, hard = runs
    assert soft.contacts is not None
    assert hard.contacts is not None
    assert soft.contacts.kernel.force.any()
    assert (soft.contacts.kernel.force == hard.contacts.kernel.force).all()
    assert [bool(body.rigid) for body in hard.bodies] == [True] * 11 + [False]
    assert (soft.bodies[-1].displacement == hard.bodies[-1].displacement).all()
    assert hard.energy().contact == soft.energy().contact
    assert 0 < hard.energy().elastic < soft.energy().elastic
    assert hard.step > soft.step


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::qdem_fem.files.errors.StepWarning")
def test_a_run_of_rigid_grains_says_what_it_leaves_out_and_is_tried_for_itself(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bed is tried once for every kind of grain, and its file keeps all answers."""
    monkeypatch.setattr(bearing, "PULSES", replace(bearing.PULSES, lasts=1e-3))
    kinds = {"false": "", "true": ", grains rigid", '"lumped"': ", grains rigid (lumped)"}
    for kind in kinds:
        prepared = prepared_in(folder, f"track.rigid={kind}", "track.stays=5.0")
        said = " ".join(prepared.scene.list_left_out())
        assert ("deformation of grains" in said) == (kind != "false")
        make_simulation(prepared)
        assert "; with friction 0.577 a slow pulse of 2155 N" in prepared.trial["words"]
    trials = read_bed(prepared.bed_file, prepared.recipe).trials
    assert set(trials) == {f"friction 0.577, 2155 N{kind}" for kind in kinds.values()}


def test_rigid_grains_are_refused_on_a_card(tmp_path: Path) -> None:
    """Before anything is prepared."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    with pytest.raises(SceneError, match="rigid grains are computed on the processor"):
        load_scene(path, ["track.rigid=true", 'simulation.device="cuda"'])
    with pytest.raises(SceneError, match=r"track\.rigid"):
        load_scene(path, ['track.rigid="hard"'])
