"""``trackbed qdem``: run folders, interruptions to the same bits, refusals, what it prints."""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import qdem_fem.scene as scene_room
from qdem_fem.cli import run as cli
from qdem_fem.files.errors import Interrupted, SceneError, StepWarning, UsageError
from qdem_fem.files.output import read_table
from trackbed.run_files import digest_file, open_seal

ROOT = Path(__file__).parents[2]
SCENE = """\
title = "A short bar & its blow"
[[body]]
name = "bar"
mesh = { box = { size = [0.4, 0.1, 0.1], cells = [8, 2, 2] } }
material = { young = 1e9, poisson = 0.2, density = 1000.0 }
[simulation]
duration = 0.02
threads = 1
[[fix]]
body = "bar"
nodes = { set = "x-min" }
[[load]]
body = "bar"
nodes = { set = "x-max" }
force = { csv = "blow.csv", time = "t", value = "p", direction = [0, 0, -1] }
[output]
vtu_interval = 0.004
probes = { tip = { nearest = [0.4, 0.05, 0.05] }, middle = { nearest = [0.2, 0, 0] } }
"""
START = (
    "import sys, argparse; from qdem_fem.cli import run as cli; p = argparse.ArgumentParser();"
    "cli.register('qdem', p); a = p.parse_args(sys.argv[1:]); sys.exit(a.command(a))"
)
"""The verb in a process of its own, whatever ``trackbed`` lists."""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene that runs in a second, with a load series beside it."""
    (tmp_path / "blow.csv").write_text("t,p\n0,0\n0.001,10\n0.002,0\n")
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def command(*words: object) -> int:
    """The verb in this process."""
    parser = argparse.ArgumentParser()
    cli.register("qdem", parser)
    arguments = parser.parse_args([str(word) for word in words])
    code: int = arguments.command(arguments)
    return code


def results(folder: Path) -> dict[str, bytes]:
    """Files of a run that depend on nothing but the scene."""
    names = ["probes.csv", "energy.csv", "fields.pvd", *(p.name for p in folder.glob("*.vtu"))]
    return {name: (folder / name).read_bytes() for name in names}


def stop_at(monkeypatch: pytest.MonkeyPatch, share: float, stop: Callable[[], None]) -> None:
    """Call ``stop`` once, when a run has done a share of its steps."""
    whole, stopped = cli.Progress.report, []

    def at(self: cli.Progress, steps: float, total: float, text: str) -> None:
        whole(self, steps, total, text)
        if steps >= share * total and not stopped:
            stopped.append(True)
            stop()

    monkeypatch.setattr(cli.Progress, "report", at)


@pytest.mark.long
def test_run_writes_what_it_promises(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tables, fields, manifest, result and a report that loads nothing, for one short run."""
    assert command(scene, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    folder = scene.with_name("scene-run")
    kept = open_seal(json.loads((folder / "result.json").read_text()))
    tables = {name: digest_file(folder / name) for name in ("energy.csv", "probes.csv")}
    assert printed | {"digests": tables} == kept | {"folder": str(folder)}
    assert (folder / "scene.toml").read_text() == SCENE

    step, total = printed["step"], printed["steps"]
    assert step == pytest.approx(0.9 * printed["critical_step"]["value"])
    assert total * step == pytest.approx(0.02, rel=2e-3)
    rows, energy = read_table(folder / "probes.csv"), read_table(folder / "energy.csv")
    assert list(rows)[1:] == [f"{name}_{axis}" for name in ("tip", "middle") for axis in "xyz"]
    spacing = np.diff(rows["time"])
    assert spacing == pytest.approx(spacing[0])
    assert rows["time"][[0, -1]] == pytest.approx([0, total * step], rel=1e-12)
    assert energy["time"][-1] == rows["time"][-1]
    assert np.diff(energy["time"])[:-1].min() > 99.5 * step  # a row costs as much as many steps
    assert printed["energy"]["external"] > 0

    fields = sorted(folder.glob("fields_*.vtu"))
    assert [path.name for path in fields] == [f"fields_{i:06}.vtu" for i in range(len(fields))]
    last = meshio.read(fields[-1])
    tip = np.argmin(np.linalg.norm(last.points - [0.4, 0.05, 0.05], axis=1))
    end = [rows[f"tip_{axis}"][-1] for axis in "xyz"]
    assert last.point_data["displacement"][tip] == pytest.approx(end, rel=1e-12)
    assert end == printed["probes"]["tip"]["end"]
    times = re.findall(r'timestep="([^"]+)"', (folder / "fields.pvd").read_text())
    assert len(times) == len(fields)
    assert float(times[-1]) == pytest.approx(total * step)

    report = (folder / "report.html").read_text()
    assert "A short bar &amp; its blow" in report
    assert not re.search(r'(src|href)="(?!data:)', report)
    for words in ("contact and friction", "Critical step", "blow.csv", "turned right-handed"):
        assert words in report
    assert report.count("<img") == len(list(folder.glob("picture-*.png"))) == 4


def find_result(scene: Path, name: str, *words: str) -> dict[str, Any]:
    """What a run with some overrides came to."""
    folder = scene.with_name(name)
    overrides = [word for override in words for word in ("--set", override)]
    command(scene, "--run-folder", folder, "--no-pictures", *overrides)
    return dict(json.loads((folder / "result.json").read_text()))


def stiffness_of(size: tuple[float, float, float]) -> tuple[Any, Any]:
    """The scene's mesh with other sizes, and its P1 stiffness matrix by scikit-fem [N/m]."""
    import skfem
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    from qdem_fem.mesh.generation import make_box_mesh

    mesh = make_box_mesh(size, (8, 2, 2))
    basis = skfem.Basis(
        skfem.MeshTet(mesh.nodes.T, mesh.elements.T), skfem.ElementVector(skfem.ElementTetP1())
    )
    return mesh, linear_elasticity(*lame_parameters(1e9, 0.2)).assemble(basis)


def test_frequency_of_the_run_is_that_of_its_own_matrices(scene: Path) -> None:
    """The mode found is an eigenvalue of K u = w^2 M u, as Verlet sees it.

    K is scikit-fem's.  Verlet moves w to 2 asin(w dt/2)/dt, by 1e-4 of itself.  The section is a
    third as wide as high, so that bending in y and z do not beat.
    """
    from scipy.linalg import eigh

    from qdem_fem import Body, Material, Simulation

    size = (0.4, 0.1, 0.3)
    words = (
        "body.bar.mesh={box={size=[0.4, 0.1, 0.3], cells=[8, 2, 2]}}",
        "simulation.duration=0.05",
    )
    result = find_result(scene, "run", *words)
    found, step = result["modes"]["tip_z"][0]["frequency"], result["step"]
    mesh, stiffness = stiffness_of(size)
    mass = np.repeat(Simulation([Body(mesh, Material(1e9, 0.2, 1e3))]).assembly.mass, 3)
    free = np.flatnonzero(np.repeat(mesh.nodes[:, 0] > 0, 3))
    square = eigh(stiffness.toarray()[np.ix_(free, free)], np.diag(mass[free]), eigvals_only=True)
    expected = np.arcsin(np.sqrt(square[:4]) * step / 2) / (np.pi * step)
    assert min(abs(found / expected - 1)) < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("share", [0.0, 0.13, 0.5, 0.97])
def test_interrupted_run_goes_on_to_the_same_bits(scene: Path, monkeypatch, share: float) -> None:
    """SIGTERM saves the state (exit 130); --resume ends with every byte of an uninterrupted run."""
    whole, parts = scene.with_name("whole"), scene.with_name("parts")
    command(scene, "--run-folder", whole, "--no-pictures")
    stop_at(monkeypatch, share, lambda: os.kill(os.getpid(), signal.SIGTERM))
    with pytest.raises(Interrupted, match=r"SIGTERM.*saved") as caught:
        command(scene, "--run-folder", parts, "--no-pictures")
    assert caught.value.exit_code == 130
    assert not (parts / "result.json").exists()
    # A writer killed behind the checkpoint leaves rows and fields that do not count.
    with (parts / "probes.csv").open("a") as stream:
        stream.write("0.0199,1,2,3,4,5,6\n0.01")
    (parts / "fields_000099.vtu").write_text("torn")
    assert command(scene, "--run-folder", parts, "--resume", "--no-pictures") == 0
    assert results(parts) == results(whole)


@pytest.mark.long
def test_killed_run_goes_on_to_the_same_bits(scene: Path) -> None:
    """SIGKILL at any moment, several times: what comes out in the end is the uninterrupted run."""
    whole, parts = scene.with_name("whole"), scene.with_name("parts")
    longer = ("--set", "simulation.duration=0.06", "--no-pictures")
    longer += ("--set", "output.checkpoint_interval=0.0")
    command(scene, "--run-folder", whole, *longer)
    kills = 0
    for attempt in range(12):
        words = [str(scene), "--run-folder", str(parts), "--resume", *longer]
        process = subprocess.Popen(
            [sys.executable, "-c", START, *words], cwd=ROOT, stdout=subprocess.DEVNULL
        )
        checkpoint = parts / "checkpoint.npz"
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        while process.poll() is None and kills < 3:
            if checkpoint.exists() and checkpoint.stat().st_mtime_ns != before:
                time.sleep(0.03 * attempt)
                process.kill()
                kills += 1
                break
            time.sleep(0.002)
        if process.wait() == 0:
            break
    assert kills
    assert results(parts) == results(whole)


def test_a_finished_run_is_made_longer(scene: Path, capsys) -> None:
    """To the bits of one that was so long from the start, and a row more in energy.csv, where the
    first one ended; a run whose rows follow from its duration is not."""
    words = ["--no-pictures", "--set", "output.vtu_interval=0.0005"]
    named = ["--set", "output.sampling=1e-4", "--set", "output.energy_interval=7e-4"]
    short, long = (["--set", f"simulation.duration={one}"] for one in ("0.001", "0.002"))
    part, whole = (["--run-folder", scene.with_name(name)] for name in ("part", "whole"))
    command(scene, *words, *short, "--run-folder", scene.with_name("bare"))
    with pytest.raises(UsageError, match=r"duration: 0\.001 there, 0\.002 now"):
        command(scene, *words, *long, "--run-folder", scene.with_name("bare"), "--resume")
    command(scene, *words, *named, *short, *part)
    command(scene, *words, *named, *long, *part, "--resume")
    command(scene, *words, *named, *long, *whole)
    for name in ("probes.csv", "checkpoint.npz", "fields_000003.vtu"):
        assert (part[1] / name).read_bytes() == (whole[1] / name).read_bytes()
    rows, there = ((one[1] / "energy.csv").read_text().splitlines() for one in (part, whole))
    assert [row for row in rows if row in there] == there
    assert len(rows) == len(there) + 1
    with pytest.raises(UsageError, match="of another scene"):
        command(scene, *words, *named, *short, *part, "--resume")


def test_folder_is_never_lost_unasked(scene: Path) -> None:
    """Another scene, an unfinished or finished run: each refused in its words."""
    folder = scene.with_name("scene-run")
    quick = (
        "--no-pictures",
        "--set",
        "simulation.duration=0.001",
        "--set",
        "output.vtu_interval=0.001",
    )
    command(scene, *quick)
    before = results(folder)
    with pytest.raises(UsageError, match=r"is there already and is finished.*\n.*--force"):
        command(scene, *quick)
    with pytest.raises(
        UsageError, match=r"another scene:\n  scene\.simulation\.safety: 0.9 there, 0.5 now"
    ):
        command(scene, *quick, "--set", "simulation.safety=0.5", "--resume")
    assert command(scene, *quick, "--resume") == 0
    (folder / "result.json").unlink()
    with pytest.raises(UsageError, match="is not finished"):
        command(scene, *quick)
    free = ("simulation.threads=2", "output.modes=1", "output.audit=0.5")
    rest = (*(word for key in free for word in ("--set", key)), "--resume")
    assert command(scene, *quick, *rest) == 0  # nothing of the record depends on these
    (folder / "result.json").unlink()
    lines = (folder / "probes.csv").read_text().splitlines(keepends=True)
    (folder / "probes.csv").write_text("".join(lines[:-1]))
    with pytest.raises(UsageError, match=rf"probes.csv: {len(lines) - 1} rows .* were written"):
        command(scene, *quick, "--resume")
    (folder / "probes.csv").write_text("".join(lines))
    scene.with_name("blow.csv").write_text("t,p\n0,0\n0.001,11\n0.002,0\n")
    with pytest.raises(UsageError, match=r"files\.blow\.csv: "):
        command(scene, *quick, "--resume")
    assert results(folder) == before
    (folder / "mine.txt").write_text("notes")
    assert command(scene, *quick, "--force") == 0
    assert results(folder) != before
    assert (folder / "mine.txt").read_text() == "notes"

    with pytest.raises(UsageError, match="exclude each other"):
        command(scene, "--force", "--resume")


def test_dry_run_tells_and_writes_nothing(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A dry run names elements, step, steps, cost and what is left out, and leaves no file."""
    before = sorted(scene.parent.iterdir())
    assert command(scene, "--dry-run", "--json") == 0
    outlook: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert outlook["bodies"]["bar"]["elements"] == 6 * 8 * 2 * 2
    assert outlook["bodies"]["bar"]["mass"] == pytest.approx(4.0)
    assert outlook["bodies"]["bar"]["smallest_altitude"] == pytest.approx(0.05 / np.sqrt(2))
    assert outlook["steps"] * outlook["step"] == pytest.approx(0.02, rel=2e-3)
    assert outlook["estimated_s"] > 0
    assert outlook["vtu_files"] == 6
    assert command(scene, "--dry-run") == 0
    words = capsys.readouterr().out
    assert "192 elements" in words
    assert "not in this run: viscosity" in words
    assert sorted(scene.parent.iterdir()) == before


def test_wrong_scene_makes_no_folder(scene: Path) -> None:
    """A scene with faults is refused (exit 3) before anything is written."""
    with pytest.raises(SceneError, match=r"simulation\.duration") as caught:
        command(scene, "--set", "simulation.duration=-1")
    assert caught.value.exit_code == 3
    with pytest.raises(SceneError, match="no static answer"):
        command(scene, "--set", 'simulation.method="static"', "--set", 'fix.0.components="x"')
    assert not scene.with_name("scene-run").exists()


def test_folder_that_can_not_be_made_is_a_sentence(scene: Path) -> None:
    """A file where the folder should be: refused with its name and what to do."""
    with pytest.raises(UsageError, match=r"scene\.toml: can not be written \(.+\)\n  -> a file is"):
        command(scene, "--run-folder", scene)


def test_mass_scaling_is_reported(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What scaling adds to the mass is in the outlook, the result and the report."""
    assert command(scene, "--dry-run", "--json") == 0
    plain = json.loads(capsys.readouterr().out)
    assert plain["mass_scaling"] == {}
    scaled = ("--set", f"simulation.mass_scaling={2 * plain['step']}", "--no-pictures")
    folder = scene.with_name("scaled")
    assert command(scene, "--run-folder", folder, *scaled) == 0
    result = json.loads((folder / "result.json").read_text())
    added = result["mass_scaling"]
    assert added["added_mass"] == pytest.approx(4.0 * added["share"])
    # Elements are congruent, so that all masses grow alike: the step by the root of the factor.
    longer = result["critical_step"]["value"] / plain["critical_step"]["value"]
    assert added["share"] > 1
    assert longer == pytest.approx(np.sqrt(1 + added["share"]), rel=1e-4)
    assert "Mass scaling added" in (folder / "report.html").read_text()


def test_warnings_of_what_comes_before_the_run_are_sentences(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bed of a track is prepared there: no file, line and code of ours on the way."""
    make = scene_room.make_simulation

    def made(prepared: Any) -> Any:
        warnings.warn("the step is short", StepWarning, stacklevel=1)
        return make(prepared)

    monkeypatch.setattr(scene_room, "make_simulation", made)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert command(scene, "--no-pictures", "--set", "simulation.duration=0.004") == 0
    lines = capsys.readouterr().err.splitlines()
    assert "warning: the step is short" in lines
    assert not [line for line in lines if ".py" in line]


def test_progress_lines_go_to_standard_error(capsys, monkeypatch) -> None:
    """A plain line every ten seconds, with the time left."""
    clock = iter([0.0, 1.0, 5.0, 12.0, 13.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    progress = cli.Progress()
    for steps in (100, 200, 320, 330):
        progress.report(steps, 1000, f"step {steps} of 1000")
    found = capsys.readouterr()
    assert found.out == ""
    assert found.err == "step 320 of 1000, 34 s left\n"


def test_static_answer(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A static scene bends the bar to what its stiffness matrix says; each series gives its end."""
    force = "load.0.force={ramp=1.0, value=[0, 0, -1]}"
    words = ("--set", 'simulation.method="static"', "--set", force, "--json")
    assert command(scene, *words) == 0
    result = json.loads(capsys.readouterr().out)
    tip = result["probes"]["tip"]["end"][2]
    assert tip == pytest.approx(-static_tip(), rel=1e-4)
    assert (scene.with_name("scene-run") / "fields_000000.vtu").exists()


def static_tip() -> float:
    """Deflection of the tip under 1 N by scikit-fem's P1 stiffness on the same mesh [m]."""
    import skfem

    mesh, stiffness = stiffness_of((0.4, 0.1, 0.1))
    end = np.flatnonzero(mesh.nodes[:, 0] == 0.4)
    force = np.zeros(3 * len(mesh.nodes))
    force[3 * end + 2] = 1 / len(end)
    fixed = np.flatnonzero(np.repeat(mesh.nodes[:, 0] == 0, 3))
    moved = skfem.solve(*skfem.condense(stiffness, force, D=fixed))
    tip = int(np.argmin(np.linalg.norm(mesh.nodes - [0.4, 0.05, 0.05], axis=1)))
    return float(moved[3 * tip + 2])


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("body.0.material.young=30e3", "as MPa it would be 3e+10 Pa"),
        ("body.0.material.density=2.71", "as g/cm^3 it would be 2710 kg/m^3"),
        ("body.0.mesh.box.size=[2400.0,250.0,220.0]", "as mm it would be 2.4 m"),
    ],
)
def test_doubts_reach_the_terminal_the_report_and_json(
    scene: Path, override: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is hardly meant is said thrice, a dry run says it too, and neither is refused."""
    folder = scene.parent / "out"
    short = ["--set", "simulation.method=static", "--set", "simulation.tolerance=1e-2"]
    assert command(scene, "--dry-run", "--json", "--set", override, *short) == 0
    assert any(words in said for said in json.loads(capsys.readouterr().out)["warnings"])
    options = ["--json", "--no-pictures", "--run-folder", str(folder), "--set", override]
    assert command(scene, *options, *short) == 0
    said = capsys.readouterr()
    assert words in said.err
    assert any(words in one for one in json.loads(said.out)["warnings"])
    assert words in (folder / "report.html").read_text()


def test_no_frequency_from_less_than_two_periods(scene: Path, capsys) -> None:
    """3 ms of free motion of a bar that bends at 100 Hz, as Euler and Bernoulli have it."""
    options = ["--json", "--no-pictures", "--run-folder", str(scene.parent / "out")]
    for key in ("simulation.duration", "output.vtu_interval"):
        options += ["--set", f"{key}=0.005"]
    assert command(scene, *options) == 0
    said = json.loads(capsys.readouterr().out)
    assert any("too short for a frequency of" in one for one in said["warnings"])
    found = [mode["frequency"] for modes in said["modes"].values() for mode in modes]
    assert all(frequency > 2 / 0.003 for frequency in found)


def test_a_bar_that_flies_off_has_its_own_frequency(scene: Path, capsys) -> None:
    """Hit at one end it flies, which is no mode: c/2L = 1,250 Hz along it, as a rod's (nu = 0)."""
    free = SCENE.replace('[[fix]]\nbody = "bar"\nnodes = { set = "x-min" }\n', "")
    scene.write_text(free.replace("[0, 0, -1]", "[-1, 0, 0]"))
    (scene.parent / "blow.csv").write_text("t,p\n0,0\n0.0001,10\n0.0002,0\n")
    options = ["--json", "--no-pictures", "--run-folder", str(scene.parent / "out")]
    assert command(scene, *options, "--set", "body.0.material.poisson=0.0") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["probes"]["tip"]["end"][0] < -1e-6
    assert not any("too short" in one for one in said["warnings"])
    assert said["modes"]["tip_x"][0]["frequency"] == pytest.approx(1250, rel=0.02)


@pytest.mark.parametrize(("error", "digits"), [(None, 7), (0.33, 2), (0.05, 3), (1e-9, 7)])
def test_digits_of_a_figure_follow_the_error_of_its_mesh(error: float | None, digits: int) -> None:
    """A third of it missing leaves two digits."""
    assert cli.count_digits(error) == digits
