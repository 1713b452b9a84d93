"""Procedures with names: what follows from a name and the number of cycles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.engines.fake import SETTLEMENT
from adapters.files.run_folder import RunFolder
from adapters.procedure.progress import plan_jumps
from adapters.scene.file import load_scene
from adapters.scene.procedures import NUMBERS, PROCEDURES, fill_procedure
from adapters.scene.tables import Procedure
from tests.small_bed import BY_HAND, read_rows
from trackbed.command import main
from trackbed.scenes import find_scene_file

COARSE = find_scene_file("karrech-coarse")


def load(*overrides: str) -> Procedure:
    """The procedure of the coarse scene with these overrides."""
    found = load_scene(COARSE, ['engine.name="fake"', *overrides]).procedure
    assert found is not None
    return found


@pytest.mark.parametrize("name", [*PROCEDURES])
@given(total=st.integers(4, 10**6))
def test_a_name_and_the_cycles_are_a_whole_procedure(name: str, total: int) -> None:
    """Nothing else need be said, whatever the number of cycles; what is given stays."""
    filled = fill_procedure({"name": name, "total_cycles": total})
    found = Procedure.model_validate(filled)
    assert found.k_i < total
    assert (found.tolerance is None) == (found.h is not None)
    kept = fill_procedure({"name": name, "total_cycles": total, "k_i": 2, "law": "power"})
    assert (kept["k_i"], kept["law"]) == (2, "power")


@given(st.integers(200, 10**6))
def test_growing_windows_end_evenly_in_ln_n(total: int) -> None:
    """The last jump leads to the last window; ends of windows are at equal ratios of N, at most
    1.55 but for the rounding of ends to cycles, with no jump more than that takes."""
    found = Procedure.model_validate(fill_procedure({"total_cycles": total}))
    jumps = plan_jumps(found)
    ends = np.array([jumps[0][0], *(end + 5 + NUMBERS.window for _, end in jumps)])
    assert ends[-1] == total
    ratio = ends[1:] / ends[:-1]
    assert ratio.max() <= NUMBERS.ratio * (1 + 1 / ends[0])
    assert (total / ends[0]) ** (1 / max(len(jumps) - 1, 1)) > NUMBERS.ratio or len(jumps) == 1


def test_a_scene_without_a_procedure_of_its_own_grows() -> None:
    """Ten thousand cycles, 240 of them computed; keys by hand are a procedure without a name."""
    found = load("procedure.total_cycles=10000")
    assert (found.name, found.settlement, found.move) == ("growing", "history", "smoothed")
    skipped = sum(end - start for start, end in plan_jumps(found))
    assert found.total_cycles - skipped == 240
    assert load(*BY_HAND).name is None


def test_a_name_replaces_the_keys_of_the_scene() -> None:
    """Of the scene's own procedure only the number of cycles is left, but for what is set beside
    the name."""
    found = load("procedure.name=tolerance", "procedure.k_i=30")
    assert (found.name, found.total_cycles, found.k_i) == ("tolerance", load().total_cycles, 30)
    assert (found.h, found.k, found.tolerance) == (None, None, NUMBERS.tolerance)


@given(total=st.integers(300, 10**5), k=st.integers(2, 30), healing=st.integers(1, 20))
def test_growing_jumps_leave_room_for_the_windows_given(total: int, k: int, healing: int) -> None:
    """With windows and healing cycles of one's own the last window ends at the last cycle, too."""
    keys = {"name": "growing", "total_cycles": total, "k": k, "healing_cycles": healing}
    found = Procedure.model_validate(fill_procedure(keys))
    jumps = plan_jumps(found)
    assert jumps[-1][1] + healing + k == total
    assert len(jumps) == len(found.h or ())


def test_a_tolerance_is_its_own_procedure(tmp_path, capsys) -> None:
    """Beside a name it takes its place, without one and without k_i it is one; the flags together
    are refused.  A name that is none, and cycles that are missing, are the one problem named."""
    found = load("procedure.name=growing", "procedure.tolerance=0.05")
    assert (found.name, found.tolerance, found.h) == ("tolerance", 0.05, None)
    assert fill_procedure({"total_cycles": 99, "tolerance": 0.1})["name"] == "tolerance"
    assert "name" not in fill_procedure({"total_cycles": 99, "tolerance": 0.1, "k_i": 9})
    words = ["run", str(COARSE), "--procedure", "growing", "--tolerance", "0.02"]
    assert main(words) == 2
    assert "--tolerance is the procedure tolerance" in capsys.readouterr().err
    begin, rest = COARSE.read_text(encoding="utf-8").split("[procedure]")
    scene = tmp_path / "scene.toml"
    for keys, said in (
        ("name = ['paper']\ntotal_cycles = 9", "procedure.name"),
        ("name = 'papers'", "procedure.name"),
        ("", "procedure.total_cycles"),
    ):
        scene.write_text(f"{begin}[procedure]\n{keys}\n\n[engine]{rest.split('[engine]')[1]}")
        assert main(["run", str(scene), "--dry-run"]) == 3
        assert said in capsys.readouterr().err


def test_a_named_run_is_extended_without_computing_its_start_again(tmp_path: Path) -> None:
    """Of 100 cycles the first 25 are k_i, of 300 they would be 50: an extended run keeps its 25."""
    run = tmp_path / "run"
    words = ["run", str(COARSE), "--procedure", "growing", "--cycles", "100", "--run-folder"]
    assert main([*words, str(run), "--set", "engine.name=fake", "--set", "sample.count=40"]) == 0
    before = (run / "window_000000" / "outcome.json").stat().st_mtime_ns
    assert main(["resume", str(run), "--cycles", "300"]) == 0
    assert (run / "window_000000" / "outcome.json").stat().st_mtime_ns == before
    assert int(read_rows(run)[-1]["cycle"]) == 300


@pytest.mark.parametrize("name", [*PROCEDURES])
def test_a_named_run_ends_at_its_last_cycle(tmp_path, name: str, capsys) -> None:
    """Against u = a ln(1 + N) to cycle 300, within 2 %; and the run says its procedure's name."""
    run = tmp_path / "run"
    words = ["run", str(COARSE), "--procedure", name, "--cycles", "300", "--run-folder", str(run)]
    assert main([*words, "--set", "engine.name=fake", "--set", "sample.count=40"]) == 0
    rows = read_rows(run)
    truth = SETTLEMENT * np.log(301)
    assert float(rows[-1]["mean_grain_settlement"]) == pytest.approx(truth, rel=0.02)
    assert RunFolder(run).manifest()["scene"]["procedure"]["name"] == name
    assert any(row["kind"] == "jumped" for row in rows)


def test_a_fast_run_takes_twice_the_usual_time_step(tmp_path: Path) -> None:
    usual, fast = load_scene(COARSE), load_scene(COARSE, ["engine.rayleigh_share=fast"])
    assert fast.steps_per_cycle == pytest.approx(usual.steps_per_cycle / 2, abs=100)
    assert not fast.warnings
    words = ["run", str(COARSE), "--engine", "fake", "--cycles", "30", "--fast"]
    assert main([*words, "--run-folder", str(tmp_path / "run")]) == 0
    assert RunFolder(tmp_path / "run").manifest()["scene"]["engine"]["rayleigh_share"] == 0.4
