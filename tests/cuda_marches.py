"""What a march on a GPU asks between its steps, in numba's simulator, beside the processor."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from qdem_fem.contact.bounds import bound_spring_network
from qdem_fem.contact.search.pairs import Pairs
from qdem_fem.contact.search.periodic import find_extents
from qdem_fem.contact.spheres.options import find_pair_stiffness
from qdem_fem.files import Floats, Integers
from validation.bench.qdem_gpu.contact import STEPS, stack_cubes
from validation.bench.qdem_gpu.search import Cloud, find_pairs_gpu, make_contact


def lists_gpu_shuffled(given: Cloud, seed: int) -> Pairs:
    """`find_pairs_gpu` with every bucket of cells in another order, as hardware may leave it."""
    from qdem_fem.contact.cuda import cells as cuda_cells
    from qdem_fem.contact.cuda import pairs as cuda_search

    random, in_order = np.random.default_rng(seed), cuda_cells.find_cells

    def shuffled(*asked: Any) -> Any:
        cells = in_order(*asked)
        start, order = cells.start.copy_to_host(), cells.order.copy_to_host()
        for low, high in pairwise(start):
            order[low:high] = random.permutation(order[low:high])
        cells.order.copy_to_device(order)
        return cells

    with patch.object(cuda_search, "find_cells", shuffled):
        return find_pairs_gpu(given, seed)


class Sums(NamedTuple):
    """What a march asks between its steps."""

    gap: float  # greatest of what touched [m]
    bound: float  # on omega^2 of what touches [1/s^2]
    extents: Floats  # (b,) of bodies along y [m]
    finite: bool  # whether all spheres are at numbers


def sums_gpu(given: Cloud, seed: int, first: Integers, lost: bool) -> Sums:
    """`Sums` on a GPU of bodies that begin at ``first`` (b + 1,); one vertex may be ``lost``."""
    from qdem_fem.contact.cuda import sums
    from qdem_fem.contact.cuda.arrays import DeviceContact
    from qdem_fem.kernel.cuda.step import cuda

    there = DeviceContact(make_contact(given, seed), given.side)
    moved = np.zeros((len(given.radius), 4))
    moved[:, :3] = given.position - given.before
    moved[len(moved) // 2, 1] += np.inf if lost else 0.0
    position = cuda.to_device(given.position)
    return Sums(
        sums.find_gap(there.on, position, there.walls),
        sums.bound_present(there.on, there.walls, cuda.to_device(1 + given.radius)),
        sums.find_device_extents(position, 1, cuda.to_device(first)),
        sums.find_positions(there.on, cuda.to_device(moved.ravel())),
    )


def sums_processor(given: Cloud, seed: int, first: Integers) -> Sums:
    """`sums_gpu`, of no lost vertex, by array."""
    contact, x = make_contact(given, seed), given.position
    pairs, walls = contact.pairs, contact.planes.force.any(axis=2)
    row = np.repeat(np.arange(len(x)), np.diff(pairs.first))
    ends = np.column_stack([row, pairs.second])[pairs.touching.astype(bool)]
    between = x[ends[:, 0]] - x[ends[:, 1]]
    if given.side is not None:
        between -= pairs.image[pairs.touching.astype(bool)]
    gaps = [np.linalg.norm(between, axis=1) - given.radius[ends].sum(axis=1)]
    for held, point, normal in zip(walls, given.point, given.normal, strict=True):
        gaps.append((x[held] - point) @ normal - given.radius[held])
    stiffness = contact.spheres.normal
    return Sums(
        np.concatenate(gaps).max(initial=0.0),
        bound_spring_network(
            ends, find_pair_stiffness(*stiffness[ends.T]), 2 * stiffness * walls.sum(axis=0),
            1 + given.radius,
        ),
        find_extents(x[:, 1], first),
        True,
    )  # fmt: skip


def sum_before(values: Integers) -> Integers:
    """`qdem_fem.kernel.cuda.sum_before` of (n,) on a GPU."""
    from qdem_fem.kernel.cuda import sums
    from qdem_fem.kernel.cuda.step import cuda

    found: Integers = sums.sum_before(cuda.to_device(values), len(values)).copy_to_host()
    return found


def sum_motion(displacement: Floats, velocity: Floats, mass: Floats, parts: int) -> Floats:
    """`qdem_fem.kernel.cuda.sum_motion` of fields (n, 4) by so many threads on a GPU."""
    from qdem_fem.kernel.cuda import sums as cuda_sums
    from qdem_fem.kernel.cuda.step import cuda

    with patch.object(cuda_sums, "PARTS", parts):
        return cuda_sums.sum_motion(
            *(cuda.to_device(array.ravel()) for array in (displacement, velocity, mass))
        )


def simulator_begin() -> None:
    """Small blocks: in numba's simulator every thread of a block costs, at work or not."""
    from qdem_fem.kernel.cuda import step as cuda_step

    cuda_step.THREADS_A_BLOCK = 8


def steps_launched(look: int) -> list[tuple[int, int]]:
    """Steps done and launched in each window of contact of a march whose list lasts two steps.

    The host looks every ``look`` steps whether a window has ended.
    """
    from qdem_fem.contact.cuda.arrays import DeviceContact
    from qdem_fem.kernel.cuda import assembly as cuda_assembly

    windows: list[tuple[int, int]] = []
    push, run_window = DeviceContact.launch_push, cuda_assembly.CudaAssembly.run_kernel

    def push_counted(*given: Any) -> None:
        done, launched = windows[-1]
        windows[-1] = done, launched + 1
        push(*given)

    def window_counted(*given: Any) -> tuple[int, float]:
        windows.append((0, 0))
        done, bad = run_window(*given)
        windows[-1] = done, windows[-1][1]
        return done, bad

    with (
        patch.object(cuda_assembly, "LOOK", look),
        patch.object(DeviceContact, "launch_push", push_counted),
        patch.object(cuda_assembly.CudaAssembly, "run_kernel", window_counted),
    ):
        run = stack_cubes("cuda", skin=2e-6)
        run.advance(STEPS * run.step)
    return [window for window in windows if window[1]]  # others are of elements alone
