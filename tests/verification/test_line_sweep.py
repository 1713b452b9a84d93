"""Beds of a sweep as `trackbed sweep` itself writes it go into a line."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from adapters.procedure.sweep import member as sweep_member
from tests.small_bed import read_rows, small_bed
from track_line.measured import read_beds
from trackbed.command import main

pytestmark = [
    pytest.mark.long,
    pytest.mark.peer("distributed"),
    pytest.mark.peer("pyarrow.parquet"),
]


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
