"""The verb ``trackbed line``: runs, resumes, refuses; its last line is a sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from track_line.scene import load_scene, run
from track_line.scene.file import build_line
from track_line.settling import march_line, start_line
from trackbed.command import main
from trackbed.scenes import read_template

SMALL = ["line.length=60", "line.realisations=3", "line.axles=1e4"]


@pytest.fixture
def words(tmp_path: Path) -> list[str]:
    """The command for a small line of the shipped scene."""
    path = tmp_path / "line.toml"
    path.write_text(read_template("line"))
    return ["line", str(path), *(word for key in SMALL for word in ("--set", key))]


def test_a_run_leaves_table_page_and_sentence(words, capsys):
    """D1 grows, the band is ordered, and the same numbers stand in JSON, table and report."""
    assert main(words) == 0
    printed = capsys.readouterr().out
    folder = Path(words[1]).with_name("line-run")
    answer = json.loads((folder / "result.json").read_text())
    assert printed.splitlines()[-1] == answer["sentence"]
    table = np.genfromtxt(folder / "geometry.csv", delimiter=",", names=True)
    assert table["axles"][-1] == 1e4
    assert (np.diff(table["settlement_m"]) > 0).all()
    assert table["d1_median_m"][0] < table["d1_median_m"][-1] == answer["d1_median_m"]
    assert answer["d1_low_m"] <= answer["d1_median_m"] <= answer["d1_high_m"]
    assert answer["error_of_blocks"] < 0.02
    assert answer["sentence"] in (folder / "report.html").read_text()


def test_a_summary_is_of_the_last_record(words):
    """Band, tonnage, voids, and the error: twice the difference to half the blocks over that."""
    file = load_scene(words[1], [*SMALL, "scatter.settlement=0.4", "zone=[{begin=30.0, end=33.0, "
                                 "void=2e-3}]"])  # fmt: skip
    line = build_line(file)
    last, finer = ([one for _, one in march_line(line, start_line(line), 1e4, finer=f)][-1]
                   for f in (1.0, 2.0))  # fmt: skip
    error = run.estimate_error(file, last, lambda _: None)
    records = [one for _, one in march_line(line, start_line(line), 1e4)]
    found = run.summarise_run(file, records, error)
    band = [found[f"d1_{name}_m"] for name in ("low", "median", "high")]
    assert band == pytest.approx(np.quantile(last.deviation, (0.05, 0.5, 0.95)), rel=1e-12)
    assert found["tonnage_mgt"] == pytest.approx(1e4 * 200e3 / 9.81 / 1e9)
    assert found["hanging_over_0.1_mm"] == last.voids[0].mean() > found["hanging_over_1_mm"]
    coarse, fine = (np.sqrt((one.deviation**2).mean()) for one in (last, finer))
    assert found["error_of_blocks"] == pytest.approx(2 * abs(coarse - fine) / fine, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("damage", [False, True])
def test_a_run_goes_on_to_the_same_bits(damage, words, capsys, monkeypatch):
    """Stopped behind its eighth block and gone on with, from a sound state or a damaged one."""
    assert main([*words, "--no-pictures"]) == 0
    folder, calls = Path(words[1]).with_name("line-run"), []
    whole = json.loads((folder / "result.json").read_text())

    def stop(*said: object) -> None:
        calls.append(said)
        if len(calls) == 8:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(run, "PLAN", replace(run.PLAN, apart=0.0))
        patch.setattr("trackbed.run_files.Progress.report", stop)
        assert main([*words, "--force"]) == 130
    if damage:
        with np.load(folder / "state.npz") as file:
            arrays = dict(file)
        np.savez(folder / "state.npz", **arrays | {"settled": arrays["settled"][:, :5]})
    assert main([*words, "--no-pictures"]) == 2
    assert main([*words, "--no-pictures", "--resume"]) == 0
    assert json.loads((folder / "result.json").read_text()) == whole
    assert main([*words, "--set", "line.seed=2", "--resume"]) == 2
    assert "line.seed: 1 there, 2 now" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ('law.name="shentn"', "there is no settlement law 'shentn'; did you mean shenton?"),
        ("law.parameters={lft=1.0}", "unknown parameter; did you mean lift?"),
        ("law.parameters={force=0.0}", "the law shenton finds no settlement with these"),
        ("zone=[{begin=50.0, end=70.0}]", "from 50 to 70 m is no part of the line"),
        ("track.spacing=3.0", "must be at most 1.2, not 3.0"),
        ("scatter.together=-2.0", "must be at least -1, not -2.0"),
        ("line.length=1e9", "must be at most 20000"),
        ("zone=[{begin=10.0, end=10.1}]", "no sleeper lies from 10 to 10.1 m"),
        ("track={rail_mass=0.0, sleeper_mass=0.0}", "without weight lie on no bed"),
    ],
)
def test_a_scene_that_makes_no_line_is_refused(words, override, said, capsys):
    """Exit code 3, with the key; nothing is written."""
    assert main([*words, "--set", override]) == 3
    assert said in capsys.readouterr().err
    assert not Path(words[1]).with_name("line-run").exists()


def test_values_that_no_track_has_are_named(words, capsys):
    """As shipped there is nothing to say; each key of another unit is named before the run."""
    assert main([*words, "--dry-run"]) == 0
    assert "warning" not in capsys.readouterr().err
    far = {"track.bending": 6.38, "track.rail_mass": 60210.0, "track.pad": 100.0, "track.bed": 28.0,
           "track.sleeper_mass": 15e4, "line.speed": 160.0, "line.limit": 1.5}  # fmt: skip
    sets = [word for key, value in far.items() for word in ("--set", f"{key}={value}")]
    main([*words, "--dry-run", *sets, "--set", "axle=[{load=200.0, unsprung_mass=6e5}]"])
    said = capsys.readouterr().err
    for key in (*far, "axle.0.load", "axle.0.unsprung_mass"):
        assert f"warning: {key}: a " in said


def test_a_dry_run_says_what_the_law_is_good_for(words, capsys):
    assert main([*words, "--dry-run"]) == 0
    assert "from memory" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("tamping", "said"),
    [
        ((31.0, 38.0, 47.0), "D1 reaches the limit of 1.5 mm at 38 MGT (31 ... 47)."),
        ((31.0, 38.0, None), "D1 reaches the limit of 1.5 mm at 38 MGT (31 ... later than"),
        ((0.0, 0.0, 0.0), "D1 is above the limit of 1.5 mm before the first axle."),
        ((31.0, None, None), "D1 is 1.1 mm (1 ... 1.2) at 50 MGT; 12 % of the sections reach the"),
        ((None, None, None), "D1 is 1.1 mm (1 ... 1.2) at 50 MGT and stays below the limit of"),
    ],
)  # fmt: skip
def test_the_sentence_is_an_engineers(tamping, said):
    names = ("low", "median", "high")
    summary = {f"tamping_{n}_mgt": t for n, t in zip(names, tamping, strict=True)}
    summary |= {f"d1_{n}_m": d for n, d in zip(names, (1e-3, 1.1e-3, 1.2e-3), strict=True)}
    summary |= {"limit_m": 1.5e-3, "tonnage_mgt": 50.0, "share_over_limit": 0.12}
    assert run.describe_when(summary).startswith(said)
