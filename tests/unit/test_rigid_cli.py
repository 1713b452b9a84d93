"""The verb ``trackbed rigid``: runs, resumes, refuses; nothing is lost."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rigid_lcp.scene.run import RunFolder, read_frame
from tests.rigid_runs import SLIDING_BLOCK
from trackbed import command


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "slide.toml"
    path.write_text(SLIDING_BLOCK, encoding="utf-8")
    return path


@pytest.mark.long
def test_a_run_ends_where_friction_stops_the_block(scene, capsys):
    """``s = v^2 / (2 mu g)``; a step of h stops it within ``v h`` of that."""
    assert command.main(["rigid", str(scene), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    stopped = 0.1**2 / (2 * 0.5 * 9.81)
    assert answer["positions"]["block"][0] == pytest.approx(stopped, abs=0.1 * 2e-3)
    assert answer["overlap_largest"] < 1e-12
    assert answer["residual_worst"] < 1e-9
    folder = scene.with_name("slide-run")
    for name in ("report.html", "history.csv", "movie.gif", "result.json", "picture-000003.png"):
        assert (folder / name).stat().st_size > 0
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "A block slides and stops" in text
    assert "restitution: every impact is inelastic" in text
    assert "http" not in text.replace("http-equiv", "")


def test_a_run_goes_on_from_its_last_sound_frame_to_the_same_end(scene: Path) -> None:
    assert command.main(["rigid", str(scene), "--no-pictures"]) == 0
    folder = RunFolder(scene.with_name("slide-run"))
    last = read_frame(folder.frames()[-1])
    (folder.path / "result.json").unlink()
    (folder.path / "frame_000003.npz").unlink()
    (folder.path / "frame_000002.npz").write_bytes(b"PK cut short")
    assert command.main(["rigid", str(scene), "--no-pictures"]) == 2
    assert command.main(["rigid", str(scene), "--no-pictures", "--resume"]) == 0
    again = read_frame(folder.frames()[-1])
    np.testing.assert_array_equal(again["motion"].position, last["motion"].position)
    np.testing.assert_array_equal(again["motion"].rates, last["motion"].rates)


def test_a_finished_run_is_made_longer(scene: Path, capsys) -> None:
    """To the bits of one that was so long from the start; with other steps, or shorter, it is
    another scene."""
    words = ["rigid", str(scene), "--no-pictures", "--set", "run.duration=0.04", "--set"]
    short, whole = (["--run-folder", str(scene.with_name(name))] for name in ("short", "whole"))
    assert command.main([*words, "run.frames=2", *short]) == 0
    words[4] = "run.duration=0.08"
    assert command.main([*words, "run.frames=3", *short, "--resume"]) == 2
    assert "run.duration: 0.04 there, 0.08 now" in capsys.readouterr().err
    assert command.main([*words, "run.frames=4", *short, "--resume"]) == 0
    assert command.main([*words, "run.frames=4", *whole]) == 0
    ends = [read_frame(RunFolder(Path(one)).frames()[4])["motion"] for _, one in (short, whole)]
    np.testing.assert_array_equal(ends[0].position, ends[1].position)
    np.testing.assert_array_equal(ends[0].rates, ends[1].rates)
    words[4] = "run.duration=0.04"
    assert command.main([*words, "run.frames=2", *short, "--resume"]) == 2


def test_another_scene_needs_force(scene: Path, capsys, monkeypatch) -> None:
    """The folder is looked at before anything is compiled."""
    run = ["rigid", str(scene), "--no-pictures"]
    assert command.main(run) == 0
    with monkeypatch.context() as context:
        context.setattr("rigid_lcp.scene.make_simulation", None)
        assert command.main([*run, "--set", "run.step=1e-3"]) == 2
        assert "another scene" in capsys.readouterr().err
        assert command.main([*run, "--resume"]) == 0
    assert command.main([*run, "--set", "run.step=1e-3", "--force"]) == 0


def test_a_dry_run_writes_nothing(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["rigid", str(scene), "--dry-run", "--json"]) == 0
    outlook = json.loads(capsys.readouterr().out)
    assert (outlook["bodies"], outlook["steps"]) == (1, 30)
    assert outlook["estimated_s"] > 0
    assert not scene.with_name("slide-run").exists()


@pytest.mark.parametrize(
    ("change", "code"), [("density = 2000.0", 3), ("position = [0.0, 0.02]", 6), ("step = -1", 3)]
)
def test_bad_scenes_have_their_exit_codes(scene: Path, change: str, code: int) -> None:
    key = change.partition(" ")[0]
    kept = [line for line in SLIDING_BLOCK.splitlines() if not line.startswith(f"{key} =")]
    if key != "density":
        table = "[run]" if key == "step" else "[[body]]"
        kept.insert(kept.index(table) + 1, change)
    scene.write_text("\n".join(kept), encoding="utf-8")
    assert command.main(["rigid", str(scene)]) == code
    assert not scene.with_name("slide-run").exists()


def test_resume_and_force_exclude_each_other(scene: Path) -> None:
    assert command.main(["rigid", str(scene), "--resume", "--force"]) == 2


@pytest.mark.parametrize(
    "words",
    [
        [], ["slide.toml", "--frames", "3"], ["slide.toml", "slide.toml"], ["slide.toml", "--set"],
        ["slide.toml", "--run-folder"], ["slide.toml", "--res"],
    ],
)  # fmt: skip
def test_flags_that_are_none_are_named(words, scene, capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(["rigid", *(str(scene) if word == scene.name else word for word in words)])
    assert ended.value.code == 2
    assert "error: " in capsys.readouterr().err
    assert not scene.with_name("slide-run").exists()


def test_report_and_summary_say_what_was_left_out_and_what_was_not_reached(scene, capsys):
    """Without friction one unknown a contact; steps above the tolerance are counted."""
    words = ["rigid", str(scene), "--no-pictures", "--json", "--set", "surface.friction=0"]
    assert command.main([*words, "--set", "run.tolerance=1e-14"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["unknowns_a_contact"] == 1
    assert any(text.startswith("friction: ") for text in answer["left_out"])
    assert answer["tolerance"] == 1e-14
    assert (answer["steps_above"] > 0) == (answer["residual_worst"] > 1e-14)
    page = (scene.with_name("slide-run") / "report.html").read_text(encoding="utf-8")
    row = "<tr><td>steps left above the tolerance</td><td>{:,}</td></tr>"
    assert row.format(answer["steps_above"]) in page
    for text in answer["left_out"]:
        assert f"<li>{text}</li>" in page
