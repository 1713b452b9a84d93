"""Sweeps in jobs of SLURM, engines started by its srun; skipped where no SLURM answers ``sinfo``.

``sh tests/engines/slurm_one_node.sh start FOLDER`` starts one of one node; see there.
"""

from __future__ import annotations

import csv
import json
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from adapters.files.run_folder import RunFolder
from tests.engines.test_cluster_scene import SMALL
from tests.forked_commands import processes_in
from trackbed.scenes import find_scene_file

ROOT = Path(__file__).parents[2]
TINY = (
    "sample.radius=0.018", "sample.count=20", "material.grain.young=2e8",
    "loading.piston_mass=0.001", "procedure.k_i=2", "procedure.k=2", "procedure.h=0",
    "procedure.healing_cycles=0",
)  # fmt: skip
"""Twenty soft grains, 2,500 steps a cycle, windows of two cycles."""
CLUSTER = 'cores = 1\nprocesses = 1\nmemory = "1GB"\nwalltime = "00:20:00"\n'
PATIENCE_S = 300


def answer(*words: object) -> str:
    """What a command of SLURM says; skips the test where there is none or it fails."""
    if shutil.which(str(words[0])) is None:
        pytest.skip("SLURM is not installed")
    said = subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=60)
    if said.returncode != 0:
        asked = shlex.join(map(str, words))
        pytest.skip(f"no SLURM answers {asked} (tests/engines/slurm_one_node.sh starts one)")
    return said.stdout


@pytest.fixture(autouse=True)
def slurm(monkeypatch: pytest.MonkeyPatch) -> None:
    """A SLURM is here, and its jobs find trackbed as if it were installed."""
    if "up" not in answer("sinfo", "-h", "-o", "%a"):
        pytest.skip("no partition of this SLURM is up")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


def set_words(settings: Sequence[str]) -> list[str]:
    """KEY=VALUE as words of a command."""
    return [word for one in settings for word in ("--set", one)]


def until(true: Callable[[], object]) -> None:
    """Wait for something that is about to be so."""
    deadline = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


class JobSweep:
    """A sweep of the tiny scene whose engines say in which job they run."""

    def __init__(self, folder: Path, settings: Sequence[str], *words: str) -> None:
        self.folder, self.into, self.jobs = folder, folder / "sweep", folder / "jobs"
        self.launcher("good", f'echo "$SLURM_JOB_ID" >> {self.jobs}; exec "$@"')
        self.launcher("bad", 'echo "ERROR: no licence"; exit 3')
        (folder / "cluster.toml").write_text(CLUSTER)
        scene = folder / "scene.toml"
        scene.write_text(find_scene_file("karrech-coarse").read_text())
        where = ["--scheduler", "slurm", "--cluster-config", folder / "cluster.toml"]
        self.words = [
            "sweep", scene, *set_words(settings), *words, "--into", self.into, *where, "--json",
        ]  # fmt: skip

    def launcher(self, name: str, text: str) -> None:
        path = self.folder / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def start(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "trackbed", *self.words], cwd=self.folder, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def jobs_seen(self) -> set[str]:
        """Numbers of the jobs in which an engine ran."""
        return set(self.jobs.read_text().split()) if self.jobs.exists() else set()

    def nothing_left(self) -> None:
        """No job and no process outlives the sweep."""
        until(lambda: not self.jobs_seen() & set(answer("squeue", "-h", "-o", "%i").split()))
        until(lambda: not processes_in(self.folder))


@pytest.mark.engine("liggghts")
@pytest.mark.engine("lammps")
def test_members_run_in_jobs(tmp_path: Path) -> None:
    """Two engines, a launcher that fails, two seeds: four members named, four in the band."""
    launchers = ",".join(json.dumps([str(tmp_path / name)]) for name in ("good", "bad"))
    sweep = JobSweep(
        tmp_path, [*TINY, "procedure.total_cycles=4"], "--set", "engine.name=liggghts,lammps",
        "--set", f"engine.launcher={launchers}", "--seeds", "2", "--workers", "2",
    )  # fmt: skip
    child = sweep.start()
    until(lambda: child.poll() is not None or sweep.jobs_seen())
    running = {*answer("squeue", "-h", "-t", "R", "-n", "dask-worker", "-o", "%i").split()}
    printed, said = child.communicate(timeout=PATIENCE_S)
    assert child.returncode == 8, said
    assert sweep.jobs_seen() & running  # engines ran in jobs that SLURM knew
    shown = json.loads(printed)
    assert shown["counts"] == {"failed": 4, "finished": 4}
    for one in shown["members"]:
        bad = one["settings"]["engine.launcher"].endswith('/bad"]')
        assert one["exit_code"] == (5 if bad else 0)
        assert ("no licence" in one["sentence"]) == bad
        assert (f"{one['member']}, exit code 5: " in said) == bad
    assert sorted(one["seeds"] for one in shown["settlements"]) == [2, 2]
    for name, rows in (("members", 8), ("settlement", 4 * 4), ("band", 2 * 4)):
        with (sweep.into / f"{name}.csv").open() as stream:
            assert len(list(csv.DictReader(stream))) == rows
        assert (sweep.into / f"{name}.parquet").exists()
    assert (sweep.into / "settlement.png").exists()
    sweep.nothing_left()


@pytest.mark.engine("liggghts")
def test_a_killed_job_is_replaced_and_a_stopped_sweep_leaves_none(tmp_path: Path) -> None:
    """A killed job's member goes on in the next one.  SIGTERM: exit code 130, jobs given back, no
    engine goes on; the same command would."""
    launcher = json.dumps([str(tmp_path / "good")])
    settings = [*TINY, 'engine.name="liggghts"', "procedure.total_cycles=200"]
    sweep = JobSweep(tmp_path, settings, "--set", f"engine.launcher={launcher}")
    child = sweep.start()
    until(lambda: [*sweep.into.glob("members/*/window_000002")] or child.poll() is not None)
    (first,) = sweep.jobs_seen()
    answer("scancel", first)
    until(lambda: len(sweep.jobs_seen()) == 2 or child.poll() is not None)
    child.terminate()
    _, said = child.communicate(timeout=PATIENCE_S)
    assert child.returncode == 130, said
    assert "the same command goes on with the sweep" in said
    (run,) = (sweep.into / "members").iterdir()
    assert "resumed" in [event["event"] for event in RunFolder(run).events()]
    sweep.nothing_left()


JOB = """\
#!/bin/sh
#SBATCH --job-name=bed --nodes=1 --ntasks=2 --time=00:10:00 --output=job.txt
{python} -m trackbed run scene.toml --run-folder run
"""


@pytest.mark.parametrize(("engine", "mpi"), [("liggghts", "pmix"), ("lammps", "pmi2")])
@pytest.mark.engine("liggghts")
@pytest.mark.engine("lammps")
def test_srun_starts_the_engine(engine: str, mpi: str, tmp_path, monkeypatch) -> None:
    """The cluster's scene, small, as a batch job of two tasks: srun takes their number from it."""
    settings = [
        *(one for one in SMALL if "frequency" not in one), f'engine.name="{engine}"',
        f'engine.launcher=["srun", "--mpi={mpi}"]', "procedure.k_i=1", "procedure.k=2",
        "procedure.total_cycles=3",
    ]  # fmt: skip
    answer("srun", f"--mpi={mpi}", "-n", 1, "true")  # the plugin may lack its library
    (tmp_path / "scene.toml").write_text(find_scene_file("cluster").read_text())
    text = JOB.format(python=sys.executable).rstrip()
    words = shlex.join(set_words(settings))
    (tmp_path / "job.sh").write_text(f"{text} {words}\n")
    monkeypatch.setenv("OMPI_MCA_mpi_yield_when_idle", "1")  # other work may hold the processors
    ran = subprocess.run(["sbatch", "--wait", "job.sh"], cwd=tmp_path, capture_output=True)
    assert ran.returncode == 0, (tmp_path / "job.txt").read_text()
    outcomes = RunFolder(tmp_path / "run").outcomes()
    assert outcomes[-1].last_cycle == 3
    logs = [path.read_text() for path in (tmp_path / "run").rglob("screen.txt")]
    assert logs
    assert all("2 by 1 by 1 MPI" in text for text in logs)
