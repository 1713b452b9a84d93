"""Beds of a sweep as `trackbed sweep` itself writes it go into a line; kilometres are swept."""

from __future__ import annotations

import csv
import json
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest

from adapters.procedure.sweep import member as sweep_member
from tests.small_bed import read_rows, small_bed
from track_line.measured import read_beds
from track_line.scene.file import build_line, load_scene
from track_line.settling import march_line, start_line
from trackbed.command import main
from trackbed.scenes import read_template

pytestmark = pytest.mark.long


def test_a_sweep_on_the_fake_engine(tmp_path, monkeypatch, capsys):
    """Two loads on three packings: pressures are mean + amplitude/2, settlements and stiffness
    those of the tables, jumps are named; the figures come out, whatever they are."""

    def run(words, folder, watch):
        return main(words[words.index("trackbed") + 1 :]), 0.0, 0.0

    monkeypatch.setattr(sweep_member, "run_process", run)
    scene, into = tmp_path / "scene.toml", tmp_path / "sweep"
    scene.write_text(small_bed(k=2, h=2, total_cycles=40))
    words = ["--set", "loading.amplitude=7075,14150", "--seeds", "3", "--workers", "1"]
    assert main(["sweep", str(scene), *words, "--into", str(into)]) == 0
    capsys.readouterr()
    beds = read_beds(into)
    np.testing.assert_allclose(beds.pressure, np.repeat([10612.5, 14150.0], 3))
    assert beds.packing.tolist() == [1, 2, 3, 1, 2, 3]
    with (into / "members.csv").open() as stream:
        runs = [into / row["run_folder"] for row in csv.DictReader(stream)]
    for bed, run_folder in zip(beds.settled, runs, strict=True):
        late = [float(row["loaded_body_settlement"]) for row in read_rows(run_folder)[-5:]]
        assert min(late) <= bed[-1] <= max(late)
    assert (beds.bedding > 0).all()
    assert sum("has jumps" in note for note in beds.notes) == 6
    assert main(["line", "--beds", str(into), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["beds"], found["packings"], found["loads"]) == (6, 3, 2)


def test_kilometres_of_a_line_are_joined(tmp_path, monkeypatch, capsys):
    """Each row is the line of its seed, in order; a fourth kilometre is added by itself; another
    axle is refused before anything runs."""
    scene, into, ran = tmp_path / "line.toml", tmp_path / "sweep", []
    small = ("line.length=60", "line.realisations=2", "line.axles=1e3")
    sets = [word for key in small for word in ("--set", key)]
    sweep = ["sweep", str(scene), *sets, "--into", str(into), "--workers", "1"]

    def run(words, folder, watch):
        ran.append(words)
        with redirect_stdout(StringIO()):
            return main([*words[words.index("trackbed") + 1 :], "--no-pictures"]), 0.0, 0.0

    monkeypatch.setattr(sweep_member, "run_process", run)
    scene.write_text(read_template("line"))
    assert main([*sweep, "--seeds", "3"]) == 0
    with (into / "members.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for seed, row in enumerate(rows, 1):
        line = build_line(load_scene(scene, [*small, f"line.seed={seed}"]))
        *_, (_, last) = march_line(line, start_line(line), 1e3)
        assert float(row["d1_median_m"]) == pytest.approx(np.median(last.deviation), rel=1e-12)
    assert (into / "members.png").read_bytes().startswith(b"\x89PNG")
    assert main([*sweep, "--seeds", "4"]) == 0
    assert [words[-1] for words in ran[3:]] == ["line.seed=4"]
    member = into / "members" / rows[0]["member"]
    result = (member / "result.json").read_text()
    (member / "result.json").write_text('{"d1_low_m": "x"}')
    assert main([*sweep, "--seeds", "4"]) == 8  # not finished, and its run says why
    assert str(member) in capsys.readouterr().err
    (member / "result.json").write_text(result)
    kept = (member / "manifest.json").read_text()
    (member / "manifest.json").write_text("{")
    assert main([*sweep, "--seeds", "4"]) == 3
    assert "manifest of a member can not be read" in capsys.readouterr().err
    (member / "manifest.json").write_text(kept)
    scene.write_text(read_template("line").replace("load = 200e3", "load = 250e3"))
    assert main([*sweep, "--seeds", "4"]) == 3
    assert "axle.0.load: 200000.0 there, 250000.0 now" in capsys.readouterr().err
