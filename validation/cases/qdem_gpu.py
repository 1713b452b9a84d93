"""QDEM on a GPU: the same physics as on the processor, and how fast.

The comparison of the two kernels needs no GPU: it runs in numba's simulator, in a process of its
own, as the simulator is chosen when numba.cuda is imported.  Speeds are measured only where there
is a GPU; without one the case says so and gives none.

Mel/s: million elements times steps a second.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import qdem_fem as q
from qdem_fem.bodies import Given
from qdem_fem.files.errors import LibraryMissing
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem_gpu.beam import FORCE, MATERIAL, SIZE
from validation.bench.qdem_gpu.contact import compare_contacts
from validation.bench.qdem_gpu.packing import check_packing, time_action
from validation.case import Check

Floats = NDArray[np.float64]
Precision = Literal["float64", "float32"]
Device = Literal["cpu", "cuda"]

STRAINS: tuple[Any, ...] = ("finger", "small", "svk")
DEVICES: tuple[Device, ...] = ("cpu", "cuda")
PRECISIONS: tuple[Precision, ...] = ("float64", "float32")

ROUND_OFF = 50.0
"""Roundings that two orders of the same sums may lie apart.

A node's force is a sum over some twenty elements of some ten operations each; displacements are
compared with the largest, velocities with the largest of them and of displacement over time step:
below the critical step a force changes no velocity by more than four times that.
"""
TWIN_STEPS = 6
CELLS = {440: (22, 2, 2), 27_840: (87, 8, 8), 488_400: (222, 22, 20), 1_536_000: (320, 32, 30),
         5_068_800: (480, 48, 44)}  # fmt: skip
"""Cells of the beam in each direction by number of elements, five in a cell."""
SPEED_STEP = 0.3
"""Time step of the races over the time of a wave along a cell [-]: well below the critical one,
which takes a minute to find on the largest mesh."""
TIP = 92.22e-6
"""Static deflection of that mesh of 488,400 elements under 200 N [m]."""


def run(quick: bool) -> list[Check]:
    """Twins in the simulator; with a GPU also on it, speeds, bandwidth, cantilever, packing."""
    checks = []
    for name, error in compare_in_simulator().items():
        checks.append(_check(f"GPU kernel in the simulator over CPU kernel: {name}", error, 1.0))
    try:
        from qdem_fem.kernel.cuda.assembly import require_gpu

        require_gpu()
    except LibraryMissing as error:
        absent = f"GPUs used: no speed of a GPU was measured ({error.what})"
        return [*checks, Check(absent, 0.0, "finite", True)]
    for name, apart in compare_twins().items():
        checks.append(_check(f"GPU over CPU kernel: {name}", apart, 1.0))
    for stage in list_stages(quick).values():
        checks += stage()
    return checks


def list_stages(quick: bool) -> dict[str, Callable[[], list[Check]]]:
    """What is asked of a GPU beside `compare_twins`, short parts first."""
    sizes = [488_400] if quick else list(CELLS)
    return {
        "packing": partial(check_packing, 8 if quick else 16),
        **{f"speed, {size} elements": partial(check_speed, size) for size in sizes},
        "cantilever": lambda: [check_cantilever(quick)],
    }


def _check(name: str, value: float, bar: float) -> Check:
    return Check(name, value, f"<= {bar:g}", value <= bar, "of round-off")


# --- the two kernels on the same input ----------------------------------------------------------


def compare_in_simulator() -> dict[str, float]:
    """`compare_twins` in a new process with numba's simulator of a GPU."""
    code = (
        "import json; from qdem_fem.kernel.cuda import step; step.THREADS_A_BLOCK = 16; "
        "from validation.cases.qdem_gpu import compare_twins; print(json.dumps(compare_twins()))"
    )
    variables = os.environ | {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_NUM_THREADS": "1"}
    finished = subprocess.run(
        [sys.executable, "-c", code], env=variables, check=True, capture_output=True, text=True,
        cwd=Path(__file__).parents[2],
    )  # fmt: skip
    found: dict[str, float] = json.loads(finished.stdout)
    return found


def compare_twins() -> dict[str, float]:
    """Largest difference between CPU and GPU after a few steps, over its bar, for every variant.

    Each variant starts from a random strain of some percent and a random velocity.
    """
    found = {}
    for strain, precision, viscous in product(STRAINS, PRECISIONS, (False, True)):
        name = f"{strain}, {precision}" + ", viscous" * viscous
        found[name] = compare_two(strain, precision, viscous, set_conditions)
    found["no condition at all"] = compare_two("finger", "float64", False, leave_free)
    found["in frames of its own"] = compare_two("finger", "float32", False, set_loads)
    found["periodic"] = compare_two("finger", "float64", False, tie_sides)
    found["inversion: steps, count and state"] = compare_stops(-80.0, 12)
    found["not a number: steps and count"] = compare_stops(np.nan, 12)
    return found | compare_contacts()


Conditions = Callable[[q.Simulation, q.Body], None]


def leave_free(run: q.Simulation, body: q.Body) -> None:
    """Free flight."""


def set_conditions(run: q.Simulation, body: q.Body) -> None:
    """Every kind of condition, several of them on the same nodes."""
    left, right = body.nodes[:, 0] == 0, body.nodes[:, 0] == 1
    run.fix(body, left)
    run.prescribe(body, right, "y", q.make_ramp(1e-2, 1e-3))
    run.load(body, right, lambda t: (30.0, 20.0, -100 * np.cos(500 * np.asarray(t))))
    run.pressure(body, body.nodes[:, 2] == 0.5, 2e3)
    for normal in ((0, 1, 1), (1, 2, 0)):
        run.roller(body, (body.nodes[:, 0] == 0.5) & (body.nodes[:, 1] == 0), normal)


def set_loads(run: q.Simulation, body: q.Body) -> None:
    """Loads and gravity on a body that is free, and so has a frame in single precision."""
    run.load(
        body, body.nodes[:, 0] == 1, lambda t: (30.0, 20.0, -100 * np.cos(500 * np.asarray(t)))
    )


def tie_sides(run: q.Simulation, body: q.Body) -> None:
    """The y-faces move as one."""
    run.periodic(body, body.nodes[:, 1] == 0, body.nodes[:, 1] == 0.5)
    run.fix(body, body.nodes[:, 0] == 0, "x")


def make_twin(
    device: Device, strain: Any, precision: Precision, viscous: bool,
    conditions: Conditions,
) -> tuple[q.Simulation, q.Body]:  # fmt: skip
    """A block of 24 elements with a random motion, and its simulation at half the critical step."""
    mesh = make_box_mesh((1.0, 0.5, 0.5), (2, 2, 1), "kuhn")
    material = q.Material(
        young=1e6, poisson=0.3, density=1000.0, shear_viscosity=50.0 * viscous,
        bulk_viscosity=20.0 * viscous,
    )  # fmt: skip
    body = q.Body((mesh.nodes, mesh.elements), material, name="block")
    gravity = None if conditions is leave_free else (0.3, 0.0, -9.81)
    run = q.Simulation(
        [body], strain=strain, precision=precision, step=1.5e-3, gravity=gravity, threads=1,
        device=device,
    )  # fmt: skip
    conditions(run, body)
    random = np.random.default_rng(20)
    body.displacement = random.uniform(-0.01, 0.01, body.nodes.shape)
    body.velocity = random.uniform(-0.5, 0.5, body.nodes.shape)
    return run, body


def compare_two(strain: Any, precision: Precision, viscous: bool, conditions: Conditions) -> float:
    """Largest difference of displacement, velocity, samples and work, over its bar."""
    results = []
    critical = None
    for device in DEVICES:
        run, body = make_twin(device, strain, precision, viscous, conditions)
        run.elements_critical_step = critical or run.critical_step  # found once, on the processor
        critical = run.elements_critical_step
        ratio = run.step / critical.value
        if not 0.1 < ratio < 0.9:
            raise ValueError(f"the step is {ratio:.2f} of the critical one: choose another")
        histories = [
            run.advance(n * run.step, {"all": np.arange(len(body.nodes))}, 2 * run.step)
            for n in (TWIN_STEPS // 2 + 1, TWIN_STEPS - TWIN_STEPS // 2 - 1)
        ]
        samples = np.concatenate([history["all"] for history in histories])
        results.append((body.displacement, body.velocity, samples, run.motion.work.copy(), run))
    (u, v, samples, work, run), (u2, v2, samples2, work2, _) = results
    fastest = max(abs(v).max(), abs(u).max() / run.step)
    energy = 0.5 * run.assembly.mass.sum() * fastest**2
    bar = ROUND_OFF * float(np.finfo(precision).eps)
    return float(
        max(
            abs(u - u2).max() / abs(u).max(),
            abs(v - v2).max() / fastest,
            abs(samples - samples2).max() / abs(u).max(),
            abs(work - work2).max() / energy,
        )
        / bar
    )


def compare_stops(speed: float, steps: int) -> float:
    """A window whose elements turn bad as a corner is driven in; inf unless both stop at once."""
    results = []
    for device in DEVICES:
        run, body = make_twin(device, "finger", "float64", False, leave_free)
        assembly, (loads, held) = run.assembly, run.pack_lists()
        velocity = np.zeros(body.nodes.shape)
        velocity[np.argmax(body.nodes.sum(axis=1))] = speed
        assembly.set_field("velocity", velocity)
        given = Given(np.ones((steps + 1, 1)), loads, held)
        done, bad = assembly.advance_window(steps, run.step, given, np.zeros(3))
        results.append((done, bad, np.nan_to_num(assembly.field("displacement"))))
    (done, bad, u), (done2, bad2, u2) = results
    if (done, bad) != (done2, bad2) or not 1 < done < steps or not bad > 0:
        return float("inf")
    return float(abs(u - u2).max() / abs(u).max() / (ROUND_OFF * np.finfo(float).eps))


# --- speeds, only on a GPU ----------------------------------------------------------------------


def make_beam(
    elements: int, precision: Precision, short: bool = False
) -> tuple[q.Simulation, q.Body]:
    """The paper's cantilever on the GPU, at 0.9 of the critical step or a ``short`` one."""
    mesh = make_box_mesh(SIZE, CELLS[elements], "five")
    young, poisson, density = MATERIAL
    body = q.Body((mesh.nodes, mesh.elements), q.Material(young, poisson, density), name="beam")
    cell = min(length / cells for length, cells in zip(SIZE, CELLS[elements], strict=True))
    step = SPEED_STEP * cell / np.sqrt(young / density) if short else None
    run = q.Simulation([body], precision=precision, device="cuda", step=step)
    run.fix(body, body.nodes[:, 0] == 0)
    return run, body


def count_bytes(run: q.Simulation) -> int:
    """Least bytes of a step, from the arrays: every access of a kernel to an array counts once.

    Elements read their data and displacements and add to forces (read, write); nodes read and
    write displacement, velocity and force and read their mass and list of actions.
    """
    assembly: Any = run.assembly
    state = assembly.state
    once = (assembly._rows, assembly._corners, state.inverse_mass)
    nodal = 3 * state.displacement.nbytes + 2 * state.velocity.nbytes + 4 * state.forces.nbytes
    return int(sum(array.nbytes for array in once) + nodal + 4 * assembly.n_nodes)


def measure_bandwidth(size: int = 1 << 30, repeats: int = 20) -> float:
    """Bytes read and written a second by a copy within the GPU, the best of five [B/s]."""
    from qdem_fem.kernel.cuda.step import cuda

    source, target = (cuda.device_array(size, np.uint8) for _ in range(2))
    seconds = []
    for _ in range(6):
        cuda.synchronize()
        start = time.perf_counter()
        for _ in range(repeats):
            target.copy_to_device(source)
        cuda.synchronize()
        seconds.append(time.perf_counter() - start)
    return 2 * size * repeats / min(seconds[1:])


def check_speed(elements: int) -> list[Check]:
    """Mel/s of whole windows by wall time, a step's time, and the share of the copy bandwidth."""
    bandwidth = measure_bandwidth()
    checks = [Check("GPU, copy bandwidth", bandwidth / 1e9, "finite", True, "GB/s")]
    for precision in PRECISIONS:
        run, body = make_beam(elements, precision, short=True)
        run.load(body, body.nodes[:, 0] == SIZE[0], FORCE)
        count = min(1_000_000_000 // elements, 20_000)
        seconds = time_action(partial(run.advance, count * run.step, sampling=1.0), 5)
        finite = bool(np.isfinite(body.displacement).all())
        speed = count * elements / seconds if finite else np.nan
        share = speed / elements * count_bytes(run) / bandwidth
        name = f"GPU, {elements:,} elements, {precision}"
        checks += [
            Check(name, speed / 1e6, "finite", finite, "Mel/s"),
            Check(f"{name}: a step", 1e6 * seconds / count, "finite", finite, "us"),
            Check(f"{name}, share of the copy bandwidth", share, "<= 1", share <= 1),
        ]
    return checks


def check_cantilever(quick: bool) -> Check:
    """Seconds for 2 s (quick: 0.04 s) of the paper's cantilever; the beam swings about its tip."""
    run, body = make_beam(488_400, "float64")
    run.load(body, body.nodes[:, 0] == SIZE[0], (0, 0, -200.0))
    tip = np.argmin(abs(body.nodes - (SIZE[0], SIZE[1] / 2, SIZE[2] / 2)).sum(axis=1))
    _ = run.step  # the critical step is not part of the time
    start = time.perf_counter()
    duration = 0.04 if quick else 2.0
    history = run.advance(duration, {"tip": tip}, sampling=1e-4)
    seconds = time.perf_counter() - start
    deflection = -history["tip"][:, 2]
    # a load put on at once: the swing goes from nought to twice the static tip, with overtones
    swings = bool(1.9 * TIP < deflection.max() < 2.2 * TIP)
    what = (
        f"GPU, {duration:g} s of the cantilever, {run.steps_done} steps; bar: tip to 1.9-2.2 static"
    )
    return Check(what, seconds, "finite", swings, "s")
