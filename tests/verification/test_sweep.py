"""A sweep, here and on Dask: failed members are named, the others finish, killed it goes on."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.files.run_folder import RunFolder
from adapters.procedure.sweep import member as sweep_member
from adapters.procedure.sweep import run as run_sweep
from adapters.procedure.sweep.member import Ended
from adapters.procedure.sweep.plan import Member, Sweep
from tests.forked_commands import comes_true, gone
from tests.small_bed import small_bed
from trackbed import command

ANY_PORT = "127.0.0.1:0"
"""Of a scheduler's pages: Dask's own port is taken where two sweeps run at once."""
ROOT = Path(__file__).parents[2]
FREQUENCIES = ("--set", "loading.frequency=10,20")


def table_read(path: Path) -> Any:
    """A table of a sweep."""
    from pyarrow import parquet

    return parquet.read_table(path)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene file of the small bed, on the fake engine: one jump from cycle 4 to 6."""
    path = tmp_path / "scene.toml"
    path.write_text(small_bed(k=2, h=2, total_cycles=10))
    return path


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Members run in this process, one after the other; the words of each are kept."""
    ran: list[list[str]] = []

    def run(
        words: Sequence[str], folder: Path, watch: Callable[[], None]
    ) -> tuple[int, float, float]:
        watch()
        words = list(words[words.index("trackbed") + 1 :])
        ran.append(words)
        screen = (folder / "screen.txt").open("w")
        with screen, redirect_stdout(screen), redirect_stderr(screen):
            return command.main(words), 0.0, 0.0

    monkeypatch.setattr(sweep_member, "run_process", run)
    return ran


def sweep(
    capsys: pytest.CaptureFixture[str], *words: object
) -> tuple[int, dict[str, Any] | None, str]:
    """Exit code, JSON and standard error of ``trackbed sweep``, one member at a time."""
    code = command.main(["sweep", *map(str, words), "--workers", "1", "--json"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out) if printed.out else None, printed.err


@pytest.mark.peer("pyarrow.parquet")
def test_tables_and_picture(scene: Path, tmp_path, in_process: list[list[str]], capsys) -> None:
    """Every member's cycles and their mean are in CSV and Parquet alike; the rest is not run."""
    into = tmp_path / "sweep"
    code, shown, _ = sweep(capsys, scene, *FREQUENCIES, "--seeds", 2, "--into", into)
    assert code == 0
    assert shown is not None
    assert shown["counts"] == {"finished": 4}
    assert len(in_process) == 4
    assert (into / "settlement.png").read_bytes().startswith(b"\x89PNG")
    for name, rows in (("members", 4), ("settlement", 4 * 9), ("band", 2 * 9)):
        table = table_read(into / f"{name}.parquet")
        with (into / f"{name}.csv").open() as stream:
            lines = list(csv.reader(stream))
        assert table.num_rows == len(lines) - 1 == rows
        assert table.column_names == lines[0]
    members = table_read(into / "members.parquet").to_pydict()
    assert members["loading.frequency"] == [10.0, 10.0, 20.0, 20.0]
    assert members["sample.seed"] == [1, 2, 1, 2]
    curves = table_read(into / "settlement.parquet").to_pydict()
    band = table_read(into / "band.parquet").to_pydict()
    for frequency, cycle, mean in zip(
        band["loading.frequency"], band["cycle"], band["loaded_body_m"], strict=True
    ):
        own = [
            s for f, c, s in zip(
                curves["loading.frequency"], curves["cycle"], curves["loaded_body_settlement"],
                strict=True
            ) if (f, c) == (frequency, cycle)
        ]  # fmt: skip
        assert mean == pytest.approx(np.mean(own), rel=1e-12)
    first = into / shown["members"][0]["run_folder"]
    assert curves["loaded_body_settlement"][:9] == [
        row["loaded_body"] for outcome in RunFolder(first).outcomes() for row in outcome.rows
    ]

    code, shown, said = sweep(capsys, scene, *FREQUENCIES, "--seeds", 3, "--into", into)
    assert code == 0
    assert "6 members, 4 finished" in said
    assert [words[-1] for words in in_process[4:]] == ["sample.seed=3", "sample.seed=3"]


def test_without_extra_libraries(
    scene: Path, tmp_path: Path, in_process: list[list[str]], monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """A sweep on this machine needs neither Dask nor PyArrow, and leaves its tables as CSV."""
    for name in ("distributed", "dask_jobqueue", "pyarrow"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr("adapters.procedure.sweep.results.find_spec", lambda _: None)
    code, shown, _ = sweep(capsys, scene, "--seeds", 2, "--into", tmp_path / "sweep")
    assert code == 0
    assert shown is not None
    assert sorted(shown["files"]) == ["band.csv", "members.csv", "picture", "settlement.csv"]
    with (tmp_path / "sweep" / "members.csv").open() as stream:
        assert [row["state"] for row in csv.DictReader(stream)] == ["finished", "finished"]


@pytest.mark.peer("pyarrow.parquet")
def test_failed_members_are_named_and_the_others_finish(
    scene: Path, tmp_path: Path, in_process: list[list[str]], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """An engine that is missing fails its members only; mended, the same command runs just them.
    Members of two scenes are never mixed; nor is a folder of something else taken."""
    into = tmp_path / "sweep"
    words = (scene, "--set", "engine.name=liggghts,fake", "--seeds", 2, "--into", into)
    with monkeypatch.context() as context:
        context.setenv("PATH", "/nonexistent")
        code, shown, said = sweep(capsys, *words)
    assert code == 8
    assert shown is not None
    assert shown["counts"] == {"failed": 2, "finished": 2}
    assert [one["exit_code"] for one in shown["members"]] == [4, 4, 0, 0]
    assert said.count("engine.name=liggghts,sample.seed=1, exit code 4: ") == 1
    assert "apt-get install" in shown["members"][0]["sentence"]
    members = table_read(into / "members.parquet").to_pydict()
    assert members["state"] == ["failed", "failed", "finished", "finished"]
    assert [one["seeds"] for one in shown["settlements"]] == [2]

    scene.write_text(scene.read_text() + "# another comment changes nothing\n")
    in_process.clear()
    with monkeypatch.context() as context:
        context.setenv("PATH", "/nonexistent")
        assert sweep(capsys, *words)[0] == 8
    assert len(in_process) == 2
    scene.write_text(scene.read_text().replace("7075.0", "7100.0"))
    code, _, said = sweep(capsys, *words)
    assert code == 3
    assert "loading.mean: 7075.0 there, 7100.0 now" in said
    assert sweep(capsys, scene, "--into", into / "members")[0] == 2
    assert len(in_process) == 2


def test_dry_run_runs_none(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each member's command line, one that a shell takes, and no folder."""
    words = ["sweep", str(scene), *FREQUENCIES, "--into", str(tmp_path / "sweep"), "--dry-run"]
    assert command.main(words) == 0
    out = capsys.readouterr().out
    assert out.count("--run-folder") == 2
    assert "# loading.frequency=20,sample.seed=1: waiting" in out
    assert not (tmp_path / "sweep").exists()


@pytest.mark.peer("distributed")
@pytest.mark.peer("dask_jobqueue")
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler answers"),
        (["--scheduler", "somewhere"], "no Dask scheduler answers"),
        (["--workers", "0"], "a worker at least"),
        (["--cluster-config", "x.toml"], "for --scheduler slurm only"),
        (["--scheduler", "slurm", "--cluster-config", "x.toml"], "cannot read it as TOML"),
    ],
)
def test_wrong_use(
    words: list[str], sentence: str, scene: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """A scheduler that does not answer, and flags that can not be, end with exit code 2."""
    monkeypatch.setattr("adapters.procedure.sweep.cluster.CONNECT_S", 1)
    assert command.main(["sweep", str(scene), "--into", str(tmp_path / "sweep"), *words]) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.peer("distributed")
def test_any_dask_cluster_by_its_address(
    scene: Path, tmp_path: Path, in_process: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    """A scheduler that is there already is used, by its address, and left running."""
    from distributed import Client, LocalCluster

    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://",
        host="127.0.0.1", dashboard_address=None, scheduler_kwargs={"dashboard_address": ANY_PORT},
    ) as cluster:  # fmt: skip
        address = cluster.scheduler_address
        assert address.startswith("tcp://")
        words = (scene, "--seeds", 2, "--into", tmp_path / "sweep", "--scheduler", address)
        code, shown, _ = sweep(capsys, *words)
        with Client(cluster) as client:
            assert client.scheduler_info()["workers"]
    assert code == 0
    assert shown is not None
    assert shown["scheduler"] == address
    assert shown["counts"] == {"finished": 2}
    assert len(in_process) == 2


SBATCH = """\
#!/bin/sh
# A queue of one machine: the job starts at once, from a copy, as the script is removed.
job=$(mktemp -p "${0%/*}/jobs")
cp "$1" "$job"
setsid sh "$job" > /dev/null 2>&1 < /dev/null &
echo $! > "$job.pid"
echo "Submitted batch job $!"
"""
SCANCEL = "#!/bin/sh\nkill -- -$1\n"


@pytest.mark.long
@pytest.mark.peer("distributed")
@pytest.mark.peer("dask_jobqueue")
def test_slurm_jobs_that_are_lost_are_replaced(tmp_path: Path) -> None:
    """``--scheduler slurm`` submits a job; killed, its member goes on in the next; none is left."""
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    scene, config, jobs = tmp_path / "scene.toml", tmp_path / "cluster.toml", tmp_path / "jobs"
    scene.write_text(small_bed(k=2, h=0, total_cycles=60))
    config.write_text('cores = 1\nprocesses = 1\nmemory = "1GB"\n')
    jobs.mkdir()
    into = tmp_path / "sweep"
    words = ["sweep", scene, "--into", into, "--scheduler", "slurm", "--cluster-config", config]
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    child = subprocess.Popen(
        [sys.executable, "-m", "trackbed", *words, "--json"],
        env=os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)},  # as if it were installed
        cwd=tmp_path, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
    )  # fmt: skip
    assert comes_true(lambda: list(into.glob("members/*/window_000002")), within_s=300)
    (pid,) = (int(file.read_text()) for file in jobs.glob("*.pid"))
    os.killpg(pid, signal.SIGKILL)
    printed, _ = child.communicate(timeout=300)
    assert child.returncode == 0
    assert json.loads(printed)["counts"] == {"finished": 1}
    assert len(list(jobs.glob("*.pid"))) == 2
    (run,) = (into / "members").iterdir()
    assert "resumed" in [event["event"] for event in RunFolder(run).events()]
    assert gone(tmp_path)


def test_stopped_it_goes_on(
    scene: Path, tmp_path: Path, in_process: list[list[str]], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """SIGTERM while the second member runs: exit code 130, what to do; then finished."""
    into, run = tmp_path / "sweep", sweep_member.run_process

    def stopped_in_the_second(
        asked: Sequence[str], folder: Path, watch: Callable[[], None]
    ) -> tuple[int, float, float]:
        if "sample.seed=2" in asked:
            os.kill(os.getpid(), signal.SIGTERM)
            while True:  # until the sweep has told its members to stop
                watch()
                time.sleep(0.01)
        return run(asked, folder, watch)

    words = (scene, "--seeds", 3, "--into", into)
    with monkeypatch.context() as context:
        context.setattr(sweep_member, "run_process", stopped_in_the_second)
        code, shown, said = sweep(capsys, *words)
    assert code == 130
    assert shown is None
    assert "the same command goes on with the sweep" in said
    members = json.loads((into / "sweep.json").read_text())["members"]
    assert [one["state"] for one in members] == ["finished", "stopped", "stopped"]
    code, shown, said = sweep(capsys, *words)
    assert code == 0
    assert "3 members, 1 finished" in said
    assert len(in_process) == 3


def test_a_signal_loses_no_result(
    scene: Path, tmp_path: Path, in_process: list[list[str]], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """SIGTERM just when a member's end is looked at: it counts as finished all the same."""
    into, look, sent = tmp_path / "sweep", run_sweep.find_result, []

    def signalled(one: Sweep, member: Member, ended: Ended | None) -> run_sweep.Result:
        if ended is not None and not sent:
            sent.append(member.name)
            os.kill(os.getpid(), signal.SIGTERM)
        return look(one, member, ended)

    monkeypatch.setattr(run_sweep, "find_result", signalled)
    assert sweep(capsys, scene, "--seeds", 2, "--into", into)[0] == 130
    states = {
        one["member"]: one["state"]
        for one in json.loads((into / "sweep.json").read_text())["members"]
    }
    assert states[sent[0]] == "finished"


@pytest.mark.long
def test_killed_it_goes_on(scene: Path, tmp_path, in_process: list[list[str]], capsys) -> None:
    """A kill leaves no process behind; the same command ends with the tables of unstopped runs."""
    into = tmp_path / "sweep"
    words = ["sweep", str(scene), "--seeds", "2", "--into", str(into), "--workers", "1"]
    child = subprocess.Popen(
        [sys.executable, "-m", "trackbed", *words], stderr=subprocess.DEVNULL, cwd=tmp_path
    )
    first, second = (into / "members" / f"sample.seed={seed}" for seed in (1, 2))
    assert comes_true(
        second.exists, within_s=300
    )  # the first member is finished, the second has begun
    child.kill()
    assert child.wait() == -signal.SIGKILL
    assert gone(tmp_path)
    members = json.loads((into / "sweep.json").read_text())["members"]
    assert [one["state"] for one in members] == ["finished", "waiting"]

    code, _, said = sweep(capsys, *words[1:-2])
    assert code == 0
    assert "2 members, 1 finished" in said
    assert len(in_process) == 1
    for seed, run in ((1, first), (2, second)):
        whole = tmp_path / f"whole_{seed}"
        alone = ["run", str(scene), "--run-folder", str(whole), "--set", f"sample.seed={seed}"]
        assert command.main(alone) == 0
        assert (whole / "settlement.csv").read_bytes() == (run / "settlement.csv").read_bytes()
