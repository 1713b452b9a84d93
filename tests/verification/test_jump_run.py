"""Whole controlled runs on the fake engine: to the end, taken back, refused, killed, reported."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from adapters.engines import fake as engine_fake
from adapters.engines.fake import FakeBed
from adapters.errors import JumpRefused, SceneError
from adapters.files.run_folder import RunFolder
from adapters.jumps.control import join_stretch
from adapters.jumps.rates import Stretch
from adapters.jumps.slopes import Landing
from adapters.laws.fit.regime import RATCHETING, STEADY
from adapters.procedure import run as procedure
from adapters.procedure import stages
from adapters.procedure.controlled import find_sinking_regime
from adapters.procedure.progress import Progress
from adapters.procedure.record import read_run_record, read_track
from adapters.procedure.status import read_status
from adapters.report.control import describe_control
from adapters.report.page import write_report
from adapters.scene.file import load_scene
from tests.forked_commands import Commands
from tests.jump_curves import CURVES
from tests.small_bed import read_rows, small_bed
from trackbed import command
from trackbed.scenes import find_scene_file

QUIET = Progress(quiet=True)


def small(folder: Path, total: int = 300, tolerance: float = 0.02) -> Path:
    """The scene of a small bed with a tolerance."""
    text = small_bed(k=2, h=2, total_cycles=total)
    text = text.replace("k = 2\nh = 2\n", f"tolerance = {tolerance}\n").replace(
        "k_i = 2", "k_i = 20"
    )
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def run(folder: Path, total: int = 300, **options: bool) -> list[dict[str, str]]:
    """Run it; the rows of settlement.csv."""
    procedure.run_scene(small(folder, total), folder / "run", progress=QUIET, **options)
    return read_rows(folder / "run")


@pytest.mark.long
def test_to_the_end_with_its_control(tmp_path: Path) -> None:
    """The logarithm to cycle 200: it is met within the tolerance, from half of the cycles.

    The band holds the closed form; the control shares the window before the first jump.  Events of
    earlier versions, which do not say what jumps moved, are reported all the same.
    """
    rows = run(tmp_path, 200, control=True)
    truth = engine_fake.SETTLEMENT * np.log(201)
    assert int(rows[-1]["cycle"]) == 200
    assert float(rows[-1]["mean_grain_settlement"]) == pytest.approx(truth, rel=0.02)
    assert sum(row["kind"] != "jumped" for row in rows) < 100
    shared = Path("window_000020") / "states.npz"
    assert (tmp_path / "run" / "control" / shared).samefile(tmp_path / "run" / shared)
    low, high = read_status(tmp_path / "run").band_m or (0, 0)
    assert low < truth < high
    write_report(tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Jump control" in page
    decisions = read_track(RunFolder(tmp_path / "run")).decisions
    assert page.count("<td>jump</td>") == sum(one["action"] == "jump" for one in decisions)
    assert "because it was moved (in the" in page
    written = json.loads((tmp_path / "run" / "report.json").read_text())
    assert written["band"]["low"] == pytest.approx(low)
    events = len(RunFolder(tmp_path / "run").events())
    procedure.resume(tmp_path / "run", progress=QUIET)  # finished: the same decisions, none printed
    assert read_track(RunFolder(tmp_path / "run")).decisions == decisions
    assert len(RunFolder(tmp_path / "run").events()) == events + 3  # resumed, two engines
    newer = {"moved", "correction", "kappa", "reseated", "seal"}
    older = [
        {name: value for name, value in event.items() if name not in newer}
        for event in RunFolder(tmp_path / "run").events()
    ]
    (tmp_path / "run" / "events.jsonl").write_text("\n".join(map(json.dumps, older)))
    page = write_report(tmp_path / "run").read_text()
    assert "Jump control" in page
    assert "because it was moved (in the" not in page


@pytest.mark.parametrize("jumps", ["procedure.h=8", "procedure.tolerance=0.02"])
def test_a_finished_run_is_extended(jumps: str, tmp_path, capsys) -> None:
    """Its table is that of a run which was asked for so many cycles from the start, its control's
    too; what is left of its old end is kept apart.  It is not shortened."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=4, h=8, total_cycles=47))
    words = ["run", str(scene), "--control", "--set", "procedure.k_i=15", "--set", jumps]
    assert command.main([*words, "--run-folder", str(tmp_path / "run")]) == 0
    assert command.main(["resume", str(tmp_path / "run"), "--cycles", "100"]) == 0
    assert command.main([*words, "--cycles", "100", "--run-folder", str(tmp_path / "long")]) == 0
    for one in ("", "control"):
        assert read_rows(tmp_path / "run" / one) == read_rows(tmp_path / "long" / one)
    assert list((tmp_path / "run" / "discarded").iterdir())
    assert read_status(tmp_path / "run").state == "finished"
    assert command.main(["resume", str(tmp_path / "run")]) == 0
    assert capsys.readouterr().err.endswith(f"is finished: trackbed report {tmp_path / 'run'}\n")
    assert command.main(["resume", str(tmp_path / "run"), "--cycles", "90"]) == 2
    assert "can not be shortened to 90" in capsys.readouterr().err
    assert command.main([*words, "--cycles", "200", "--run-folder", str(tmp_path / "run")]) == 3
    assert f"trackbed resume {tmp_path}/run --cycles N" in capsys.readouterr().err


def test_the_mean_grain_moves_by_what_was_decided(tmp_path: Path) -> None:
    """Before relaxation the mean drop of each jump is what the decision says, to round-off."""
    run(tmp_path, 120)
    folder = RunFolder(tmp_path / "run")
    held = read_track(folder).checks
    for decision in read_track(folder).decisions:
        if (decision["cycle"], 1) in held and decision["action"] == "jump":
            jump = folder.path / f"jump_{decision['cycle']:06d}_1"
            moved = np.load(jump / "estimated.npz")["position"][:, 2].mean()
            window = next(
                name for name in folder.stage_names()
                if (o := folder.outcome(name)) and o.stage == "window"
                and o.last_cycle == decision["cycle"]
            )  # fmt: skip
            before = np.load(folder.path / window / "states.npz")["position"][-1, :, 2].mean()
            assert before - moved == pytest.approx(decision["moved"], rel=1e-6)


def test_load_step_is_taken_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A jump into a load step is rolled back to the stored state; its window is in discarded/."""
    step = FakeBed(CURVES["early load step"])
    monkeypatch.setattr(engine_fake, "BED", step)
    rows = run(tmp_path, 200, cycle_by_cycle=True)
    folder = RunFolder(tmp_path / "run")
    back = [event for event in folder.events() if event["event"] == "jump failed"]
    assert back
    assert "taken back: the bed gained" in back[0]["why"]
    details = folder.failure_details(back[0]["stage"])
    assert abs(details["error"]) > 0.04
    assert details["lost_cycles"] > 0
    assert any((tmp_path / "run" / "discarded").iterdir())
    cycles = [int(row["cycle"]) for row in rows]
    assert cycles == sorted(set(cycles))
    assert float(rows[-1]["mean_grain_settlement"]) == pytest.approx(
        float(step.law(np.array(200.0))), rel=0.1
    )
    assert "taken back" in describe_control(read_run_record(tmp_path / "run"))


def test_collapse_is_refused_with_its_code(tmp_path, monkeypatch, capsys) -> None:
    """Exit code 6 and what to do; ``resume --cycle-by-cycle`` goes on to the end, for good."""
    monkeypatch.setattr(engine_fake, "BED", FakeBed(lambda n: 0.005 * CURVES["collapse"](n)))
    scene = small(tmp_path, 200)
    assert command.main(["run", str(scene)]) == JumpRefused.exit_code == 6
    assert "trackbed resume RUN --cycle-by-cycle" in capsys.readouterr().err
    assert command.main(["resume", str(tmp_path / "run")]) == 6
    assert command.main(["resume", str(tmp_path / "run"), "--cycle-by-cycle"]) == 0
    assert command.main(["resume", str(tmp_path / "run")]) == 0
    assert read_status(tmp_path / "run").cycles_computed == 200


@pytest.mark.long
@pytest.mark.parametrize(
    ("share", "sinking", "code"), [(0.3, 5e-6, 6), (1.0, 5e-6, 0), (0.3, 0.0, 0)]
)
def test_a_piston_that_breaks_in_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    share: float, sinking: float, code: int,
) -> None:  # fmt: skip
    """Grains settle by a logarithm and the piston by 5 um a cycle more: no jump, where it can sink.

    On all of the section it stands on the bed's surface, whose grains its record does not show; on
    a part of it, too, it may go down with its bed.
    """
    monkeypatch.setattr(engine_fake, "BED", FakeBed(sinking=sinking))
    scene = small(tmp_path, 100)
    words = ["run", str(scene), "--set", f"loading.area_share={share}"]
    assert command.main(words) == code
    why = "rate at which the piston sinks falls too slowly (ratcheting)"
    assert (why in capsys.readouterr().err) == (code == 6)
    if code:
        assert command.main(["resume", str(tmp_path / "run"), "--cycle-by-cycle"]) == 0
    assert (read_status(tmp_path / "run").cycles_computed == 100) == (code == 6)


@pytest.mark.parametrize("share", [0.0, 0.12])
def test_what_a_piston_sinks_more_behind_jumps_is_no_ratcheting(share: float) -> None:
    """u = a ln N and ``share`` G / n in the n-th cycle behind each of eight doubling jumps of gain
    G, to cycle 2,000 and more: steady at every window, though raw windows are not."""
    settled, cycle, random = 5e-5, 40, np.random.default_rng(1)
    landings: list[Landing] = []
    sunk: tuple[Stretch, ...] = ()

    def window(first: int, cycles: int) -> Stretch:
        end = first + 1.0 + np.arange(cycles)
        gain = settled * np.log(end / (end - 1))
        for one in landings:
            gain += share * one.moved / (end - one.cycle)
        none = np.full(cycles, np.nan)
        return Stretch(first, gain * (1 + 0.1 * random.standard_normal(cycles)), none, none)

    sunk = join_stretch(sunk, window(20, 20))
    regimes, raw = [], []
    for jump in range(9):
        h = min(int(0.9 * cycle), 20 * 2**jump)
        landings.append(Landing(cycle + h, settled * np.log((cycle + h) / cycle)))
        cycle += h + 5
        sunk = join_stretch(sunk, window(cycle, 10))
        cycle += 10
        regimes.append(find_sinking_regime(sunk, landings))
        raw.append(find_sinking_regime(sunk, []))
    assert cycle > 2000
    assert [one.name for one in regimes if one] == [STEADY] * 9
    assert any(one.name == RATCHETING for one in raw if one) == (share > 0)


def test_no_jump_pays_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tolerance 1e-6: every cycle is computed, and the reason is on the screen once."""
    scene = small(tmp_path, 120)
    words = ["--tolerance", "1e-6", "--cycles", "110", "--run-folder", str(tmp_path / "run")]
    assert command.main(["run", str(scene), *words]) == 0
    assert capsys.readouterr().err.count("no jump pays") == 1
    assert read_status(tmp_path / "run").cycles_computed == 110


def test_scene_keys(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A tolerance stands instead of k and h; both, or one of the two alone, is an error with a
    sentence; none of them is the procedure `growing`."""
    scene = find_scene_file("karrech-coarse")
    loaded = load_scene(scene, ["procedure.tolerance=0.02"]).procedure
    assert loaded is not None
    assert (loaded.tolerance, loaded.k, loaded.h) == (0.02, None, None)
    with pytest.raises(SceneError, match="with a tolerance h chooses itself"):
        load_scene(scene, ["procedure.tolerance=0.02", "procedure.h=3"])
    text = scene.read_text().replace("[procedure]", "[procedure]\nk = 20")
    (tmp_path / "one.toml").write_text(text)
    with pytest.raises(SceneError, match="h: missing: give k and h, or a tolerance"):
        load_scene(tmp_path / "one.toml")
    (tmp_path / "none.toml").write_text(text.replace("\nk = 20", ""))
    grown = load_scene(tmp_path / "none.toml").procedure
    assert grown is not None
    assert grown.name == "growing"
    for value in ("0", "1", '"much"'):
        with pytest.raises(SceneError, match=r"procedure\.tolerance"):
            load_scene(scene, [f"procedure.tolerance={value}"])
    words = ["run", str(scene), "--tolerance", "0.02", "--set", "procedure.h=3"]
    assert command.main(words) == 2
    assert "--tolerance chooses k and h" in capsys.readouterr().err


# --- killed ---------------------------------------------------------------------------------

STEP = "early load step"


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """A server whose beds have a load step, and an uninterrupted run in ``whole``."""
    folder = tmp_path_factory.mktemp("jump_kill")
    server = Commands(folder)
    words = ("run", small(folder, 170), "--cycle-by-cycle", "--run-folder", folder / "whole")
    server.run(*words, here=True, bed=STEP)
    yield server
    server.close()


@pytest.mark.long
def test_killed_at_file_operations(commands: Commands, tmp_path: Path) -> None:
    """Killed at the 17th change of a file, again and again: the same table and decisions.

    The run has jumps that stand and one taken back, so kills fall before, within and behind each.
    """
    whole = commands.folder / "whole"
    assert any("taken back" in str(e.get("why")) for e in RunFolder(whole).events())
    table = (whole / "settlement.csv").read_bytes()
    run_folder = tmp_path / "run"
    first = ("run", commands.folder / "scene.toml", "--cycle-by-cycle", "--run-folder", run_folder)
    kills = 0
    while True:
        words = ("resume", run_folder) if (run_folder / "manifest.json").exists() else first
        ended = commands.run(*words, root=str(run_folder), crash=17, bed=STEP)
        if ended != -signal.SIGKILL:
            break
        kills += 1
    assert ended == 0, commands.output.read_text()
    assert kills >= 5
    assert (run_folder / "settlement.csv").read_bytes() == table
    names = [RunFolder(path).stage_names() for path in (whole, run_folder)]
    assert names[0] == names[1]

    def said(path: Path) -> list[dict[str, object]]:
        return [{**e, "time": ""} for e in read_track(RunFolder(path)).decisions]

    assert said(run_folder) == said(whole)


@pytest.mark.long
def test_jump_that_fails_is_halved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relaxation that fails twice: shorter jumps from the same state, then the run goes on."""
    from adapters.errors import NotConverged

    lengths: list[int] = []
    real = stages.jump

    def fail_twice(*arguments: object) -> stages.Bed:
        lengths.append(arguments[2])  # type: ignore[arg-type]
        if len(lengths) <= 2:
            raise NotConverged("made to fail")
        return real(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(stages, "jump", fail_twice)
    rows = run(tmp_path, 120)
    assert lengths[1] == lengths[0] // 2
    assert int(rows[-1]["cycle"]) == 120
