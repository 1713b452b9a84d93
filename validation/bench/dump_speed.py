"""Speed of reading text dumps, beside pandas and OVITO or ASE on the same file.

A dump as LIGGGHTS writes it: three frames of 1e5 grains in no order, twelve columns, a blank
before each line end; once with the engine's default of six digits, once with all seventeen.
CPU time of a process with one thread, median of repeats after a warm-up.  No time counts
unless the reader returned the coordinates that were written, sorted by identifier.
Peers are looked for in this Python, then in the one that TRACKBED_PEER_PYTHON names.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from validation.case import Check

COLUMNS = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz", "radius")
FRAMES = 3
MISSING = 3
"""Exit code of the timed process when its reader is not installed."""


def run(quick: bool) -> list[Check]:
    """Speeds [MB/s] and ratios of CPU times (above 1: ours is faster)."""
    from validation.case import Check

    grains, repeats = (20_000, 5) if quick else (100_000, 7)
    checks = []
    with tempfile.TemporaryDirectory() as folder:
        first = time_first_call(Path(folder))
        checks.append(Check("first call, compilation included", first, "<= 10", first <= 10, "s"))
        for digits, reason in ((6, "the engine's default"), (17, "without loss")):
            path = Path(folder) / f"digits{digits}.dump"
            coordinate = write_dump(path, grains, digits)
            megabytes = path.stat().st_size / 1e6
            ours = measure_reader("trackbed", path, repeats, coordinate, digits)
            speed = megabytes / ours
            name = f"reading speed, {digits} digits ({reason}), {megabytes:.0f} MB"
            checks.append(Check(name, speed, ">= 60", speed >= 60, "MB/s"))
            peers = {
                peer: measure_reader(peer, path, repeats, coordinate, digits) / ours
                for peer in READERS
                if peer != "trackbed"
            }
            if np.isnan(peers["OVITO"]) != np.isnan(peers["ASE"]):  # one of the two is enough
                del peers["OVITO" if np.isnan(peers["OVITO"]) else "ASE"]
            for peer, ratio in peers.items():
                name = f"CPU time of {peer} over ours, {digits} digits"
                bar = ">= 1, with the peer installed" if np.isnan(ratio) else ">= 1"
                checks.append(Check(name, ratio, bar, ratio >= 1))
    return checks


def write_dump(path: Path, grains: int, digits: int) -> np.ndarray:
    """Write the dump; returns x of the last frame in order of identifiers [m], shape (n,)."""
    random = np.random.default_rng(2007)
    scale = np.array([1, 1, 0.05, 0.05, 0.05, 0.01, 0.01, 0.01, 1, 1, 1, 3e-4])
    row = "%d %d " + f"%.{digits}g " * 10 + "\n"
    box = "ITEM: BOX BOUNDS ff ff ff\n-1 1\n-1 1\n-1 1\n"
    with path.open("w") as stream:
        for step in range(FRAMES):
            values = random.normal(size=(grains, len(COLUMNS))) * scale
            values[:, 0], values[:, 1] = random.permutation(grains) + 1, 1
            values[:, 11] = 3.2e-3 + values[:, 11]
            stream.write(f"ITEM: TIMESTEP\n{step * 1000}\nITEM: NUMBER OF ATOMS\n{grains}\n{box}")
            stream.write(f"ITEM: ATOMS {' '.join(COLUMNS)} \n")
            stream.write((row * grains) % tuple(values.ravel().tolist()))
    return values[np.argsort(values[:, 0]), 2]


def measure_reader(reader: str, path: Path, repeats: int, values: np.ndarray, digits: int) -> float:
    """Median CPU time [s] of a reader in a process of its own; nan when it is not installed."""
    result = path.with_suffix(".npy")
    for python in (sys.executable, os.environ.get("TRACKBED_PEER_PYTHON", sys.executable)):
        command = [python, __file__, reader, str(path), str(repeats), str(result)]
        process = subprocess.run(command, env=make_environment(), capture_output=True, text=True)
        if process.returncode != MISSING:
            break
    else:
        return np.nan
    if process.returncode != 0:
        raise RuntimeError(f"{reader} failed: {process.stderr.strip()[-500:]}")
    if not np.allclose(np.load(result), values, rtol=10.0 ** (1 - min(digits, 16)), atol=0):
        raise ValueError(f"{reader} did not return the coordinates that were written")
    return float(np.median(json.loads(process.stdout)))


def time_first_call(folder: Path) -> float:
    """CPU time [s] to read a dump of one grain in a new process with nothing compiled before."""
    path = folder / "one.dump"
    write_dump(path, 1, 6)
    command = [sys.executable, __file__, "trackbed", str(path), "0", str(folder / "one.npy")]
    before = os.times()
    cache = {"NUMBA_CACHE_DIR": str(folder / "cache")}
    subprocess.run(command, env=make_environment() | cache, check=True, capture_output=True)
    after = os.times()
    return (after.children_user + after.children_system) - (
        before.children_user + before.children_system
    )


def make_environment() -> dict[str, str]:
    """One thread for every reader, and this package on the path."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OVITO_THREAD_COUNT")
    root = str(Path(__file__).resolve().parents[2])
    return os.environ | dict.fromkeys(names, "1") | {"PYTHONPATH": root}


# --- readers: each returns x of the last frame, sorted by identifier, shape (n,) ----------------


def read_trackbed(path: str) -> Any:
    from adapters.files.dump_reader import read_frames

    frames = list(read_frames(path))
    return frames[-1].column("x")


def read_pandas(path: str, precision: Any = None) -> Any:
    import pandas

    text = Path(path).read_bytes()
    stop = 0
    while (start := text.find(b"ITEM: ATOMS", stop)) >= 0:
        header_end = text.index(b"\n", start) + 1
        stop = text.find(b"ITEM: TIMESTEP", header_end) % (len(text) + 1)
        table = pandas.read_csv(
            io.BytesIO(text[header_end:stop]),
            sep=" ",
            header=None,
            usecols=range(len(COLUMNS)),
            float_precision=precision,
        ).to_numpy(np.float64)
        table = table[np.argsort(table[:, 0])]
    return table[:, COLUMNS.index("x")]


def read_pandas_round_trip(path: str) -> Any:
    return read_pandas(path, "round_trip")


def read_ovito(path: str) -> Any:
    from ovito.io import import_file

    pipeline: Any = import_file(path, sort_particles=True)
    frames = [pipeline.compute(frame) for frame in range(pipeline.source.num_frames)]
    return np.array(frames[-1].particles.positions[:, 0])


def read_ase(path: str) -> Any:
    from ase.io import read

    frames: Any = read(path, index=":", format="lammps-dump-text")
    return frames[-1].positions[:, 0]


READERS = {
    "trackbed": read_trackbed,
    "pandas": read_pandas,
    "pandas (round_trip)": read_pandas_round_trip,
    "OVITO": read_ovito,
    "ASE": read_ase,
}


def time_reads(reader: str, path: str, repeats: int, result: str) -> int:
    """What the timed process does: print its CPU times [s], save the coordinates it read."""
    try:
        coordinate = READERS[reader](path)
    except ModuleNotFoundError:
        return MISSING
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        coordinate = READERS[reader](path)
        seconds.append(time.process_time() - start)
    np.save(result, coordinate)
    print(json.dumps(seconds))
    return 0


if __name__ == "__main__":
    sys.exit(time_reads(sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]))
