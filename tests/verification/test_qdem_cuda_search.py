"""The look for pairs of spheres on a GPU against the processor's, in numba's simulator of a GPU."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.cuda_marches import (
    lists_gpu_shuffled,
    simulator_begin,
    steps_launched,
    sum_before,
    sum_motion,
    sums_gpu,
    sums_processor,
)
from validation.bench.qdem_gpu.contact import STEPS
from validation.bench.qdem_gpu.search import (
    CLOUDS,
    Cloud,
    compare_lists,
    draw_cloud,
    find_pairs_cpu,
    find_pairs_gpu,
)

pytestmark = pytest.mark.peer("numba.cuda")

EPS = float(np.finfo(float).eps)


@pytest.fixture(scope="module")
def simulator() -> Iterator[Executor]:
    """A process of its own: the simulator is chosen when numba.cuda is imported."""
    with ProcessPoolExecutor(1, get_context("spawn"), simulator_begin) as process:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("NUMBA_ENABLE_CUDASIM", "1")
            process.submit(int).result()  # it is begun now
        yield process


@settings(max_examples=80)
@example(seed=0, count=1, room=0.0, ratio=1.0, bodies=1, walls=0, skin=0.1, axis="", same=0.0)
@example(seed=1, count=14, room=0.0, ratio=1.0, bodies=4, walls=1, skin=0.1, axis="y", same=0.0)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(6, 14),
    room=st.sampled_from([2.0, 1.0, 3.0, 0.0]),
    ratio=st.sampled_from([10.0, 3.0, 1.0]),
    bodies=st.sampled_from([5, 2]),
    walls=st.integers(0, 2),
    skin=st.sampled_from([0.3, 1e-3, 1.0]),
    axis=st.sampled_from(["", "x", "y", "z"]),
    same=st.sampled_from([0.0, 0.5]),
)
@pytest.mark.long
def test_lists_are_the_processors(
    simulator: Executor, seed: int, count: int, room: float, ratio: float, bodies: int,
    walls: int, skin: float, axis: str, same: float,
) -> None:  # fmt: skip
    """Rows, back lists, walls, acting spheres, images and history, number by number.

    6 to 14 spheres in 16 to 64 buckets: of the 27 cells about a sphere several share a bucket.
    """
    given = draw_cloud(
        seed, count, room=room, ratio=ratio, bodies=bodies, walls=walls, skin=skin, axis=axis,
        same=same,
    )  # fmt: skip
    found = simulator.submit(find_pairs_gpu, given, seed).result()
    assert compare_lists(find_pairs_cpu(given, seed), found) == []


@pytest.mark.long
@pytest.mark.parametrize("axis", ["", "x"])
def test_order_within_a_bucket_changes_nothing(simulator: Executor, axis: str) -> None:
    """Which is left to the atomics of the hardware; a dense cloud, some spheres in one place."""
    dense = draw_cloud(3, 40, room=1.0, same=0.3, axis=axis)
    here = find_pairs_cpu(dense, 3)
    assert np.diff(here.first).max() > 5
    assert compare_lists(here, simulator.submit(lists_gpu_shuffled, dense, 3).result()) == []


def test_a_list_differs_where_a_sphere_does() -> None:
    """What the other tests compare: pairs, walls and history of two clouds of a kind differ."""
    one, other = (find_pairs_cpu(draw_cloud(seed, **CLOUDS["a cloud"]), seed) for seed in (0, 1))
    assert {"second", "back_pair", "touching", "spring", "pull", "wall"} <= {
        *compare_lists(one, other)
    }
    assert one.touching.any()


@pytest.mark.parametrize("parts", [1, 5, 64])
def test_energy_and_moment_are_summed(simulator: Executor, parts: int) -> None:
    """Every p-th node by one thread, 23 nodes in all: to the rounding of as many terms."""
    random = np.random.default_rng(parts)
    (u, v), mass = random.uniform(1.0, 2.0, (2, 23, 4)), random.uniform(1.0, 2.0, 23)
    expected = [(mass[:, None] * v[:, :3] ** 2).sum(), *mass @ u[:, :3]]
    found = simulator.submit(sum_motion, u, v, mass, parts).result()
    np.testing.assert_allclose(found, expected, rtol=3 * 23 * EPS)


@pytest.mark.parametrize("count", [1, 63, 64, 65, 64 * 64 + 1])
def test_sums_before_each(simulator: Executor, count: int) -> None:
    """One chunk, many, and chunks of chunks: the cumulative sum."""
    values = np.random.default_rng(count).integers(0, 5, count)
    expected = np.concatenate([[0], np.cumsum(values)])
    found = simulator.submit(sum_before, values).result()
    assert found.dtype == np.int64
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "name", ["a cloud", "radii of one to ten", "no walls", "no pairs", "a width along x"]
)
def test_what_a_march_asks_is_the_processors(simulator: Executor, name: str) -> None:
    """Gap, bound and extents to the rounding of their sums, of some ten terms each."""
    here = draw_cloud(5, **CLOUDS[name])
    first = np.array([0, 7, 7, len(here.radius)])
    expected = sums_processor(here, 5, first)
    found = simulator.submit(sums_gpu, here, 5, first, False).result()
    assert expected.gap > 0
    assert expected.bound > 0
    size = np.abs(here.position).max()
    assert found.gap == pytest.approx(expected.gap, abs=20 * EPS * size, rel=0)
    assert found.bound == pytest.approx(expected.bound, rel=20 * EPS)
    np.testing.assert_array_equal(found.extents, expected.extents)
    assert found.extents[1] == 0  # a body without a vertex
    assert found.finite


@pytest.mark.long
def test_steps_behind_the_end_of_a_window_are_not_launched(simulator: Executor) -> None:
    """But those up to the host's next look; a list of two steps ends each window but the last."""
    windows = simulator.submit(steps_launched, 3).result()
    assert sum(done for done, _ in windows) == STEPS
    assert windows[:-1] == [(2, 3)] * (STEPS // 2)


def test_a_vertex_that_is_nowhere_is_seen(simulator: Executor) -> None:
    here: Cloud = draw_cloud(5, 20)
    assert not simulator.submit(sums_gpu, here, 5, np.array([0, 20]), True).result().finite
