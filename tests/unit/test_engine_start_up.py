"""Start-up of an engine: CPU time less that of the time steps, by what each engine prints."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from adapters.engines import process
from adapters.engines.contract import get_engine
from adapters.engines.process import ProcessEngine

LOOP = "Loop time of {} on {} procs for 100 steps with 40 atoms\n"
USE = "{}% CPU use with {} MPI tasks x 1 OpenMP threads\n"


@pytest.mark.parametrize(
    ("name", "text", "cpu_s", "start_up"),
    [
        ("liggghts", LOOP.format(2.0, 1), 2.25, 0.25),
        ("liggghts", LOOP.format(2.0, 1) + LOOP.format(1.0, 1), 3.25, 0.25),
        ("liggghts", LOOP.format(2.0, 2), 4.5, 0.5),  # of two processes
        ("liggghts", LOOP.format(3.0, 1), 2.0, 0.0),  # a shared machine: never below nothing
        ("lammps", LOOP.format(3.0, 1) + USE.format(50.0, 1), 2.0, 0.5),
        ("lammps", LOOP.format(3.0, 2) + USE.format(50.0, 2), 3.5, 0.5),
        ("yade", "LOOP 1.500000 s\n", 1.75, 0.25),
    ],
)
def test_start_up_is_cpu_time(name: str, text: str, cpu_s: float, start_up: float) -> None:
    """However long the process waited: it is part of ``cpu_s``, which it is taken from."""
    engine = get_engine(name)
    assert isinstance(engine, ProcessEngine)
    assert engine.find_start_up(cpu_s, "Step\n" + text + "COMPLETE step 9\n") == start_up


def test_a_file_that_an_engine_removes_is_no_fault(tmp_path, monkeypatch) -> None:
    """Between the list of a folder and the look at its files one may go: YADE's start does."""
    for name, changed in (("gone", 9e9), ("stays", 1e9)):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (changed, changed))
    scan = os.scandir

    def remove_behind(folder: Path) -> Any:
        entries = scan(folder)
        found = list(entries)
        (tmp_path / "gone").unlink()
        return nullcontext(found)

    monkeypatch.setattr(process.os, "scandir", remove_behind)
    assert process.find_last_change(tmp_path) == 1e18
