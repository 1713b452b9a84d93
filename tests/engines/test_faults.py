"""Faults on purpose, the same on every engine: the same error, the same exit code, nothing lost.

What an engine wrote is replayed and damaged where no engine has to work for it; faults of a process
are done to a real one.  After each the run goes on and ends in the table of the undisturbed run.
"""

from __future__ import annotations

import resource
import signal
from pathlib import Path

import numpy as np
import pytest

from adapters.errors import TrackbedError
from adapters.files.run_folder import RunFolder
from adapters.procedure.run import run_scene
from adapters.scene.tables import Scene
from tests.damaged_files import (
    Damage,
    last_frame,
    lost_from_the_start,
    track_with,
    with_value,
    without_grain,
)
from tests.engine_sample import AFTER, FIRST, JUMP, QUIET, SECOND, Sample, fake_damaged
from trackbed import command

PREPARATION = "preparation"
LOST = {PREPARATION: (PREPARATION, "window_*", "jump_*"), SECOND: (SECOND, AFTER, "jump_*")}
"""A stage that is to fail, and all that comes after it."""
KEPT = {PREPARATION: [], SECOND: [PREPARATION, FIRST]}


def check_failure(
    sample: Sample, run: Path, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run ends with an exit code and a sentence on what to do, and is no bug of ours."""
    capsys.readouterr()
    assert command.main(sample.words(run)) == code
    text = capsys.readouterr().err
    assert said in text
    assert "\n  -> " in text
    assert "bug in trackbed" not in text


def check_goes_on(sample: Sample, run: Path) -> None:
    """Without the fault the run ends in the table of the undisturbed one."""
    sample.replayed(run)
    assert command.main(sample.words(run)) == 0
    assert (run / "settlement.csv").read_bytes() == sample.table


# --- what an engine may leave, with exit code 0 ----------------------------------------------


LEFT: dict[str, tuple[str, Damage, int, str]] = {
    "nan": (SECOND, with_value("z", np.nan), 6, "column z of grain 7 is nan"),
    "nan of the piston": (
        SECOND,
        track_with(slice(-5, -4), 2, np.nan),
        6,
        "piston's record is not finite",
    ),
    "lost grain": (SECOND, last_frame(without_grain), 6, "lost grains: 7"),
    "lost in the rain": (PREPARATION, lost_from_the_start, 6, "1 of 40 grains are lost"),
    "flying grain": (SECOND, with_value("z", 1e3), 6, "mean move in one cycle"),
}
"""Stage, damage to what the engine left there, exit code, words."""


@pytest.mark.parametrize("fault", LEFT)
@pytest.mark.long
def test_what_an_engine_leaves_is_judged(
    sample: Sample,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    fault: str,
) -> None:
    """Nan, lost and flying grains, files cut short: named, though the engine ended well."""
    stage, damage, code, said = LEFT[fault]
    run = sample.copy(tmp_path / "run", *LOST[stage])
    with monkeypatch.context() as patch:
        fake_damaged(patch, damage, stage)
        sample.replayed(run, damage, stage)
        check_failure(sample, run, code, said, capsys)
    assert RunFolder(run).stage_names() == KEPT[stage]
    if fault in ("nan", "lost in the rain"):
        check_goes_on(sample, run)


@pytest.mark.long
def test_absurd_time_step_is_not_credible(sample: Sample, tmp_path, monkeypatch) -> None:
    """Fifty Rayleigh times a step: whatever the engine makes of it ends in a typed error."""
    sample.need_process()
    monkeypatch.setattr(Scene, "time_step", 50 * sample.scene.rayleigh_time)
    monkeypatch.setattr(Scene, "steps_per_cycle", 100)
    with pytest.raises(TrackbedError) as caught:
        run_scene(sample.file, tmp_path / "run", overrides=sample.overrides, progress=QUIET)
    assert caught.value.exit_code in (5, 6, 7), caught.value
    assert RunFolder(tmp_path / "run").outcomes() == []


# --- faults of a process ----------------------------------------------------------------------

STARTED = "while ! test -s screen.txt; do sleep 0.01; done; sleep 0.05"
"""Wait until the engine has said something, and works."""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
@pytest.mark.long
def test_engine_killed(sample: Sample, tmp_path, capsys, number: signal.Signals) -> None:
    """An engine that someone else ends is named; nothing before it is lost, no jump is blamed."""
    sample.need_process()
    run = sample.copy(tmp_path / "run", AFTER)
    sample.fault(run, f'"$@" & {STARTED}; kill -{number.value} $!; wait $!; exit $?')
    check_failure(sample, run, 5, f"was ended by {number.name}", capsys)
    assert RunFolder(run).stage_names() == [PREPARATION, FIRST, SECOND, JUMP]
    assert not RunFolder(run).failure(JUMP)
    check_goes_on(sample, run)


@pytest.mark.long
def test_full_disk(sample: Sample, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An engine that may write no more; with room again the run goes on.

    A limit of 4 KiB on the size of files stands for the disk.
    """
    run = sample.copy(tmp_path / "run", *LOST[SECOND])
    # MPI's own large files go, so that the first to be too large is the engine's.
    plain = "export PMIX_MCA_gds=hash OMPI_MCA_btl=self; ulimit -f 8"
    sample.fault(run, f'{plain}; exec "$@"')
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    if sample.name == "fake":  # it writes from this process
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        check_failure(sample, run, 5, "", capsys)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert RunFolder(run).stage_names() == KEPT[SECOND]
    check_goes_on(sample, run)


@pytest.mark.engine("yade")
@pytest.mark.parametrize("sample", ["yade"], indirect=True)
def test_disk_with_too_little_room_for_a_saved_scene(sample: Sample, tmp_path, capsys) -> None:
    """YADE would write on a full disk for ever: its script asks for the room before.

    200 KiB are enough for each dump, and not for what is asked.
    """
    run = sample.copy(tmp_path / "run", *LOST[SECOND])
    sample.fault(run, 'ulimit -f 400; exec "$@"')
    check_failure(sample, run, 5, "File too large", capsys)
    assert RunFolder(run).stage_names() == KEPT[SECOND]


@pytest.mark.long
def test_another_mpi(sample: Sample, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A launcher of another MPI starts two whole runs in one folder: ended as soon as seen."""
    sample.need_process()
    run = sample.copy(tmp_path / "run", *LOST[SECOND])
    sample.fault(run, f"cat {sample.raw}/{SECOND}.said {sample.raw}/{SECOND}.said; sleep 60")
    check_failure(sample, run, 5, "2 runs of the engine started", capsys)
    assert RunFolder(run).stage_names() == KEPT[SECOND]
    check_goes_on(sample, run)
