"""What this machine can do at most, measured: memory bandwidth and floating-point rate.

Both are measured by compiled loops in the process and at the time of the speeds that are compared
with them.  A share of a vendor's figure would say little on a shared or virtual machine.

Bandwidth: the triad a = b + s c of STREAM (McCalpin, IEEE TCCA Newsletter, December 1995), which
counts three numbers an element, though the store first reads its cache line: the traffic is a
third larger.  Floating-point rate: fused multiply-adds x = m x + c in twelve independent chains
of vectors, enough to hide a latency of four cycles on two pipes.  The chains are given to LLVM as
vectors; nothing is left to the loop vectoriser.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import get_num_threads, njit, prange, set_num_threads, types
from numba.core import cgutils
from numba.extending import intrinsic

CHAINS = 12
"""Independent chains; with their two constants they fill 14 of the 16 registers of AVX2."""
REGISTER_BYTES = 64 if binding.get_host_cpu_features().get("avx512f", False) else 32
CACHE_BYTES = 32 * 2**20
"""Last-level cache where the system does not tell."""
CACHE_FILES = "/sys/devices/system/cpu/cpu0/cache"
QUIET_SHARE = 0.05
"""Other processes may take this share of all processors in a time that counts as quiet."""
REPEATS = 5
SHORT = 0.1
"""Length of a measurement [s]."""


@dataclass(frozen=True)
class Interval:
    """How long some work took, and who else was computing then."""

    wall: float
    """Wall time [s]."""
    cpu: float
    """Processor time of this process, all its threads [s]."""
    others: float
    """Share of all processors taken by other processes, 0 to 1; nan where it can't be known.

    The system counts in 10 ms: below an interval of half a second this is coarse.
    """

    @property
    def quiet(self) -> bool:
        """True when it is known that others took at most `QUIET_SHARE` of the processors."""
        return self.others <= QUIET_SHARE


@dataclass(frozen=True)
class MachineLimits:
    """Measured limits; best of `REPEATS`, since a disturbance only ever slows down."""

    triad_memory: dict[int, float]
    """Triad on arrays of four times the cache each [GB/s], by number of threads."""
    triad_cache: dict[int, float]
    """Triad on arrays that fill a third of the last-level cache together [GB/s]."""
    fma_float64: float
    """Peak rate of one thread in double precision [GFlop/s]."""
    fma_float32: float
    """The same in single precision."""
    fma_float64_threads: float
    """Peak rate of all the threads that were asked for together, double precision [GFlop/s]."""
    threads: int
    """The largest number of threads measured."""
    cache_bytes: int
    """Last-level cache."""
    others: float
    """Largest share of the processors that other processes took meanwhile; nan if unknown."""

    @property
    def quiet(self) -> bool:
        """True when these are limits of the machine, not of what others left of it."""
        return self.others <= QUIET_SHARE


# --- who else is computing ----------------------------------------------------------------------


def busy_seconds(stat: str) -> float:
    """Processor time that all processes took since the start [s], from the text of /proc/stat.

    Columns: user, nice, system, idle, iowait, irq, softirq, steal; the last is what a virtual
    machine's host took.
    """
    column = [int(word) for word in stat.splitlines()[0].split()[1:9]]
    return (sum(column) - column[3] - column[4]) / os.sysconf("SC_CLK_TCK")


def _busy_now() -> float:
    try:
        return busy_seconds(Path("/proc/stat").read_text())
    except (OSError, ValueError, IndexError):
        return np.nan


def measure(work: Callable[[], object]) -> Interval:
    """Do some work once and time it; the calling process must not have children at work."""
    busy, cpu, wall = _busy_now(), time.process_time(), time.perf_counter()
    work()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    busy = _busy_now() - busy
    others = (busy - cpu) / (wall * (os.cpu_count() or 1))
    return Interval(wall, cpu, others if np.isnan(others) else float(np.clip(others, 0, 1)))


# --- kernels ------------------------------------------------------------------------------------


def _triad(target: Any, first: Any, second: Any, factor: float, threads: int, rounds: int) -> None:
    """a = b + (s + r) c in rounds r = 0, 1, ...; three arrays (n,), a part of them each thread.

    Threads do not wait for one another between rounds; the factor changes, so that no round is
    superfluous to a compiler.
    """
    for thread in prange(threads):
        part = slice(thread * target.size // threads, (thread + 1) * target.size // threads)
        a, b, c = target[part], first[part], second[part]
        for number in range(rounds):
            scale = factor + number
            for i in range(a.size):
                a[i] = b[i] + scale * c[i]


triad: Any = njit(parallel=True, fastmath=True, cache=True)(_triad)


def _fma_chains(typing: Any, rounds: Any, factor: Any, addend: Any) -> Any:
    """x = factor x + addend in `CHAINS` registers, ``rounds`` times; returns a sum of some."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = factor.bitwidth
        lanes = 8 * REGISTER_BYTES // bits
        vector = ir.VectorType(context.get_value_type(factor), lanes)
        declare: Any = cgutils.get_or_insert_function
        kind = ir.FunctionType(vector, [vector] * 3)
        fma = declare(builder.module, kind, f"llvm.fma.v{lanes}f{bits}")
        position = ir.IntType(32)

        def spread(number: Any) -> Any:
            filled: Any = ir.Constant(vector, ir.Undefined)
            for lane in range(lanes):
                filled = builder.insert_element(filled, number, ir.Constant(position, lane))
            return filled

        m, c = spread(arguments[1]), spread(arguments[2])
        alloca: Any = cgutils.alloca_once_value
        chains = [alloca(builder, c) for _ in range(CHAINS)]
        with cgutils.for_range(builder, arguments[0]):
            for chain in chains:
                builder.store(builder.call(fma, [builder.load(chain), m, c]), chain)
        total = builder.load(chains[0])
        for chain in chains[1:]:  # every chain is used, so that none is optimised away
            total = builder.fadd(total, builder.load(chain))
        return builder.extract_element(total, ir.Constant(position, 0))

    return factor(types.intp, factor, factor), generate


fma_chains: Any = intrinsic(_fma_chains)


@njit(cache=True)
def fma_one(factor: Any, addend: Any, rounds: int) -> Any:
    """`fma_chains` on one thread."""
    return fma_chains(rounds, factor, addend)


@njit(parallel=True, cache=True)
def fma_threads(threads: int, factor: Any, addend: Any, rounds: int) -> Any:
    """`fma_chains` on each of ``threads`` threads."""
    total = 0.0
    for _ in prange(threads):
        total += fma_chains(rounds, factor, addend)
    return total


# --- measurements -------------------------------------------------------------------------------


def last_level_cache_bytes() -> int:
    """Size of the largest cache of processor 0, or `CACHE_BYTES`."""
    unit = {"K": 2**10, "M": 2**20, "G": 2**30}
    sizes = [0]
    for path in Path(CACHE_FILES).glob("index*/size"):
        text = path.read_text().strip()
        sizes.append(int(text[:-1]) * unit[text[-1]] if text[-1:] in unit else int(text or 0))
    return max(sizes) or CACHE_BYTES


def best_rate(work: Callable[[int], object], amount: float) -> tuple[float, float]:
    """Largest rate of ``work(rounds)``, which does ``amount`` a round, and the largest ``others``.

    The number of rounds is chosen for measurements of `SHORT` seconds.
    """
    work(1)  # compiled
    rounds = 1
    while (took := measure(partial(work, rounds)).wall) < SHORT / 4:
        rounds = int(rounds * max(2.0, SHORT / 2 / max(took, SHORT / 200)))
    rounds = max(1, round(rounds * SHORT / took))
    walls: list[float] = []

    def repeat() -> None:  # one interval for all repeats: `others` needs half a second
        for _ in range(REPEATS):
            start = time.perf_counter()
            work(rounds)
            walls.append(time.perf_counter() - start)

    others = measure(repeat).others
    return amount * rounds / min(walls), others


def machine_limits(threads: int = 2) -> MachineLimits:
    """Measure the limits of 1 and of ``threads`` threads; some five seconds, 0.4 GB."""
    cache = last_level_cache_bytes()
    others = []
    bandwidth: dict[str, dict[int, float]] = {"memory": {}, "cache": {}}
    before = get_num_threads()
    try:
        for place, size in (("memory", 4 * cache), ("cache", cache // 9)):
            arrays = [np.full(size // 8, value) for value in (0.0, 1.0, 2.0)]
            for count in sorted({1, threads}):
                set_num_threads(count)
                rate, share = best_rate(partial(triad, *arrays, 0.5, count), 24 * len(arrays[0]))
                bandwidth[place][count] = rate / 1e9
                others.append(share)
        flops = {}
        for kind in (np.float64, np.float32):
            work = 2 * CHAINS * REGISTER_BYTES / np.dtype(kind).itemsize
            flops[kind], share = best_rate(partial(fma_one, kind(0.5), kind(0.1)), work)
            others.append(share)
        set_num_threads(threads)
        work = threads * 2 * CHAINS * REGISTER_BYTES / 8
        together, share = best_rate(partial(fma_threads, threads, 0.5, 0.1), work)
        others.append(share)
    finally:
        set_num_threads(before)
    return MachineLimits(
        bandwidth["memory"],
        bandwidth["cache"],
        flops[np.float64] / 1e9,
        flops[np.float32] / 1e9,
        together / 1e9,
        threads,
        cache,
        float(np.max(others)),
    )


APART = """
import pickle, sys
from validation.machine_limits import machine_limits
pickle.dump(machine_limits(int(sys.argv[1])), sys.stdout.buffer)
"""


def machine_limits_apart(environment: Mapping[str, str], threads: int = 2) -> MachineLimits:
    """The same in a process of its own with this environment, so that no waiting thread stays."""
    command = [sys.executable, "-c", APART, str(threads)]
    process = subprocess.run(command, env=dict(environment), check=True, stdout=subprocess.PIPE)
    limits: MachineLimits = pickle.loads(process.stdout)
    return limits
