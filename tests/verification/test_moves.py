"""Ways to move grains in a jump: closed forms, invariance, known noise, what outliers may do."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import adapters.moves
from adapters.container import Container
from adapters.engine_fake import SETTLEMENT
from adapters.errors import SceneError, UsageError
from adapters.laws import law_named
from adapters.laws.law import Law
from adapters.moves import move_named, moves_known
from adapters.moves.move import Move, block_moves, grain_weights, law_moves, within_variance
from adapters.moves.move_modes import modal_moves
from adapters.moves.move_robust import upper_fence
from adapters.moves.move_shrunk import shrinkage
from adapters.moves.move_smooth_field import admissible, affine_free, elements, smooth_fit
from adapters.procedure import run_scene, scene_record
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from tests.small_bed import small_bed

LOG = law_named("log")
CYCLE = np.arange(30.0, 51.0)
QUARTER = Container("cylinder", ("x", "y"), radius=0.03)
WHOLE = Container("cylinder", radius=0.03)
QUIET = Progress(quiet=True)
WAYS = [move_named(name) for name in moves_known()]
every_way = pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
extrapolating = pytest.mark.parametrize(
    "way", [way for way in WAYS if way.name != "still"], ids=lambda way: way.name
)
keeping_mean = pytest.mark.parametrize(
    "way", [way for way in WAYS if way.name not in ("still", "per-grain")], ids=lambda way: way.name
)


def bed(seed: int = 0, count: int = 120, noise: float = 1e-6) -> tuple[FloatArray, FloatArray]:
    """Positions at 21 cycle ends [m], shape (21, n, 3), and radii [m]: a settling random bed."""
    random = np.random.default_rng(seed)
    place = random.uniform(0.002, 0.02, (count, 3))
    drop = np.multiply.outer(np.log(CYCLE / 30), -1e-5 * place[:, 2] / 0.01)
    path = noise * random.standard_normal((21, count, 3)).cumsum(axis=0)
    path[:, :, 2] += drop
    return place + path, random.uniform(2e-3, 4e-3, count)


def moved(
    way: Move, position: FloatArray, radius: FloatArray, h: float = 30, law: Law = LOG
) -> FloatArray:
    """Displacement of the bed in a quarter cylinder [m], shape (n, 3)."""
    return way.displacement(CYCLE, position, radius, law, h, QUARTER)


def test_every_file_is_a_way_of_its_name() -> None:
    """The registry is the folder; a near miss is named."""
    files = Path(adapters.moves.__file__).parent.glob("move_*.py")
    names = sorted(path.stem.removeprefix("move_").replace("_", "-") for path in files)
    assert list(moves_known()) == names == [way.name for way in WAYS]
    with pytest.raises(UsageError, match="did you mean 'shrunk'"):
        move_named("shrunken")


@every_way
def test_no_jump_no_move(way: Move) -> None:
    """h = 0 moves nothing, to the last bit."""
    assert not moved(way, *bed(), h=0).any()


@extrapolating
def test_even_compaction_goes_on(way: Move) -> None:
    """u_z = -c z ln N, without noise, is met by every way: -c z ln(80 / 50).

    To round-off of positions of .02 m, summed 20 times and amplified by 1 / ln(50 / 30); smoothing
    alone bends a linear field at the bed's border.
    """
    position, radius = bed(noise=0.0)
    move = moved(way, position, radius)
    expected = np.zeros_like(move)
    expected[:, 2] = -1e-5 * position[0, :, 2] / 0.01 * np.log(80 / 50)
    if way.name == "smoothed":
        assert move[:, 2].mean() == pytest.approx(expected[:, 2].mean(), rel=1e-9)
        assert np.linalg.norm(move - expected) < 0.3 * np.linalg.norm(expected)
    else:
        np.testing.assert_allclose(move, expected, atol=1e-13)


@keeping_mean
@pytest.mark.parametrize("law", [law_named("log"), law_named("linear")], ids=lambda law: law.name)
def test_mean_settlement_is_the_law_of_the_mean(way: Move, law: Law) -> None:
    """Whatever is cut, shrunk or smoothed, the mean vertical move is the law's own."""
    position, radius = bed(3)
    rows = slice(law.first_state, None)
    mean = (position[rows] - position[0])[:, :, 2].mean(axis=1)
    expected = float(law.increment(law.fit(CYCLE[rows], mean), 50.0, 80.0))
    assert moved(way, position, radius, law=law)[:, 2].mean() == pytest.approx(expected, rel=1e-9)


@every_way
def test_turned_renumbered_and_scaled_beds_move_alike(way: Move) -> None:
    """A quarter turn, another order of grains, another unit of length: the same moves."""
    position, radius = bed(1)
    position[..., 0] -= 0.01  # on either side of the axis
    whole = way.displacement(CYCLE, position, radius, LOG, 30, WHOLE)
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    turned = way.displacement(CYCLE, position @ turn, radius, LOG, 30, WHOLE)
    bound = 1e-8 * np.abs(whole).max()  # the least squares behind it have condition 1e4 or so
    np.testing.assert_allclose(turned, whole @ turn, atol=bound)
    order = np.random.default_rng(1).permutation(len(radius))
    renumbered = way.displacement(CYCLE, position[:, order], radius[order], LOG, 30, WHOLE)
    np.testing.assert_allclose(renumbered, whole[order], atol=bound)
    large = Container("cylinder", radius=30.0)
    scaled = way.displacement(CYCLE, 1e3 * position, 1e3 * radius, LOG, 30, large)
    np.testing.assert_allclose(scaled, 1e3 * whole, atol=1e3 * bound)


@keeping_mean
def test_a_loose_grain_is_not_flung(way: Move) -> None:
    """A grain that hops to and fro by millimetres neither flies nor carries the others along."""
    position, radius = bed(count=400)
    calm = moved(way, position, radius)
    loose = position.copy()
    hop = np.random.default_rng(5).standard_normal((21, 3)) * 2e-3
    loose[:, 7] += hop
    alone = law_moves(CYCLE, loose, LOG, 30)[7]
    change = np.linalg.norm(moved(way, loose, radius) - calm, axis=1)
    # The share of one grain in the mean of 400 is laid on all, twice at the top; the bound for the
    # rest is a quarter of what the paper's estimate throws the grain.
    assert np.linalg.norm(alone) > 5e-4
    assert change[7] < 0.25 * np.linalg.norm(alone) or way.name == "modes"
    assert np.delete(change, 7).max() < 0.25 * np.linalg.norm(alone)


# --- the noise of a window, and shrinkage -------------------------------------------------------


def test_noise_of_any_spread_has_no_signal() -> None:
    """Grains whose noise differs a thousandfold: tau^2 is 0 in the mean, in spite of the weights.

    Each sign is as likely, so the mean over seeds lies within 5 of its errors of 0; tau^2 is cut at
    0, so the product is taken without the cut: through a signal that is known and taken off.
    """
    found = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        spread = np.exp(random.uniform(-3.5, 3.5, 300))
        parts = spread[:, None] * random.standard_normal((4, 300, 3))
        share = shrinkage(parts)
        found.append(float(np.median(share / (1 - share) * within_variance(parts))))
    quiet = float(np.median(within_variance(parts)))
    positive = np.array(found) > 0
    assert 0.3 < positive.mean() < 0.7  # a cut at 0 of something symmetric
    assert np.mean(found) < 0.2 * quiet


def test_blocks_share_the_window_and_the_law() -> None:
    """Four parts of five cycles; where the law goes on unchanged each says what the whole says."""
    position, _ = bed(noise=0.0)
    parts = block_moves(CYCLE, position, LOG, 30)
    assert parts.shape == (4, 120, 3)
    np.testing.assert_allclose(parts, [law_moves(CYCLE, position, LOG, 30)] * 4, atol=1e-12)
    assert len(block_moves(CYCLE[:4], position[:4], LOG, 30)) == 2
    assert len(block_moves(CYCLE[:3], position[:3], LOG, 30)) == 0
    np.testing.assert_array_equal(grain_weights(np.empty((0, 5, 3))), np.ones(5))


def test_variance_within_a_grain_is_that_of_its_mean() -> None:
    """Independent normal parts: s^2 has mean sigma^2 / b; 9 degrees of freedom each."""
    parts = 2.0 * np.random.default_rng(0).standard_normal((4, 4000, 3))
    found = within_variance(parts)
    error = np.sqrt(2 / 9 / 4000)
    assert found.mean() == pytest.approx(4 / 4, rel=5 * error)


@pytest.mark.parametrize("ratio", [0.25, 1.0, 4.0])
def test_shrinkage_finds_the_share_that_is_signal(ratio: float) -> None:
    """Signal tau^2 under noise sigma^2 of each of four parts: tau^2 / (tau^2 + sigma^2 / 4).

    And it is worth it: the error beside the signal comes near tau^2 s^2 / (tau^2 + s^2), the least
    that a linear estimate can have, below that of taking all and of taking nothing.
    """
    random = np.random.default_rng(1)
    n, noise = 4000, 0.25
    signal = np.sqrt(ratio * noise) * random.standard_normal((n, 3))
    parts = signal + random.standard_normal((4, n, 3)) * np.sqrt(4 * noise)
    share = shrinkage(parts)
    # Loud grains count less, and signal is loud: tau^2 comes out up to a quarter low, never high.
    between = float(np.median(share / (1 - share) * within_variance(parts))) / noise
    error = 5 * np.sqrt(2 / (3 * n)) * (1 + ratio)
    assert 0.75 * ratio - error < between < ratio + error

    def risk(estimate: FloatArray) -> float:
        return float(((estimate - signal) ** 2).mean())

    mean = parts.mean(axis=0)
    least = noise * ratio / (1 + ratio)
    assert risk(share[:, None] * mean) < 1.1 * least
    assert risk(share[:, None] * mean) < min(risk(mean), risk(0 * mean))


def test_pure_noise_moves_nothing_and_pure_signal_everything() -> None:
    """Random walks without drift leave a tenth of the paper's scatter; steady ones all of it."""
    random = np.random.default_rng(2)
    place = random.uniform(0.002, 0.03, (1500, 3))
    walk = 1e-6 * random.standard_normal((21, 1500, 3)).cumsum(axis=0)
    radius = np.full(1500, 1e-3)
    way = move_named("shrunk")

    def left(path: FloatArray) -> float:
        own = law_moves(CYCLE, place + path, LOG, 30)
        own[:, 2] -= own[:, 2].mean()
        move = moved(way, place + path, radius)
        move[:, 2] -= move[:, 2].mean()
        return float((move**2).sum() / (own**2).sum())

    assert left(walk) < 0.1
    slope = 1e-6 * random.standard_normal((1500, 3))
    assert left(np.multiply.outer(np.log(CYCLE / 30), slope)) > 0.99


def test_strain_under_noise_is_kept_as_a_strain() -> None:
    """Walks of 1 um a cycle over a compaction of 0.3 um: what is left is the strain, not a shift.

    The line through moves over height vanishes at the lowest grain, to a tenth of the mean move.
    """
    random = np.random.default_rng(4)
    place = random.uniform(0.002, 0.03, (3000, 3))
    path = 1e-6 * random.standard_normal((21, 3000, 3)).cumsum(axis=0)
    path[:, :, 2] -= np.multiply.outer(np.log(CYCLE / 30), 1e-5 * place[:, 2] / 0.016)
    move = moved(move_named("shrunk"), place + path, np.full(3000, 0.8e-3))[:, 2]
    height = place[:, 2] - place[:, 2].min()
    _, shift = np.polyfit(height, move, 1)
    assert abs(shift) < 0.1 * abs(move.mean())


def test_a_window_too_short_to_prove_anything_is_strained_evenly() -> None:
    """Two cycles: no grain departs from the uniform strain."""
    position, radius = bed()
    move = move_named("shrunk").displacement(CYCLE[:3], position[:3], radius, LOG, 30, QUARTER)
    height = position[2, :, 2] - position[2, :, 2].min()
    assert not move[:, :2].any()
    np.testing.assert_allclose(move[:, 2], move[:, 2].mean() * height / height.mean(), atol=1e-18)


# --- smooth field, modes, profile, outliers ------------------------------------------------------


def test_only_what_departs_from_affine_fields_is_paid_for() -> None:
    """S P = 0, and c^T S c is the least energy that an affine field leaves, by least squares."""
    position, _ = bed(count=300)
    _, node, stiffness = elements(WHOLE, position[-1])
    free, affine = admissible(WHOLE, node, 0)
    assert affine.shape == (len(node), 4)
    cost = affine_free(stiffness[np.ix_(free, free)], affine)
    scale = np.abs(stiffness).max()
    np.testing.assert_allclose(cost @ affine, 0, atol=1e-12 * scale)
    c = np.random.default_rng(0).standard_normal(len(node))
    root = np.linalg.cholesky(stiffness + 1e-12 * scale * np.eye(len(node))).T
    left = np.linalg.lstsq(root @ affine, root @ c, rcond=None)[0]
    assert c @ cost @ c == pytest.approx(float(((root @ (c - affine @ left)) ** 2).sum()), rel=1e-6)


def test_stiffness_is_that_of_the_gradient() -> None:
    """u = x has the energy of its box: volume times 1; a constant has none."""
    position, _ = bed(count=300)
    _, node, stiffness = elements(QUARTER, position[-1])
    size = np.ptp(node, axis=0)
    assert node[:, 0] @ stiffness @ node[:, 0] == pytest.approx(float(size.prod()))
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-12 * np.abs(stiffness).max())


def test_penalty_is_chosen_by_what_it_predicts() -> None:
    """Noise over an affine field is smoothed to it; a field that bends is followed.

    2,000 grains on 4 x 4 x 4 elements: the affine fit has 4 freedoms, so noise of 1 leaves an error
    of (4 / 2000)^(1/2) = .045, all 125 nodes one of .25; the bend's own error comes from elements.
    """
    random = np.random.default_rng(3)
    place = random.uniform(0, 0.03, (2000, 3))
    place[:, :2] -= 0.015
    value, node, stiffness = elements(Container("cylinder", radius=0.015), place)
    free, affine = admissible(Container("cylinder", radius=0.015), node, 0)
    cost = affine_free(stiffness[np.ix_(free, free)], affine)
    slope, bend = place @ [40.0, -20.0, 10.0], 2 * np.sin(200 * place[:, 2])
    noise = random.standard_normal(2000)
    for truth, bound in ((slope, 0.1), (slope + bend, 0.35)):
        found = smooth_fit(value[:, free], np.ones(2000), truth + noise, cost, np.arange(2000) % 5)
        assert np.sqrt(((found - truth) ** 2).mean()) < bound
    assert np.sqrt((bend**2).mean()) > 1  # what an affine field would miss


@pytest.mark.parametrize(
    ("container", "fields"),
    [
        (QUARTER, (1, 1, 1)),
        (WHOLE, (4, 4, 1)),
        (Container("box", size_x=0.03, size_y=0.02), (0, 0, 1)),
    ],
)
def test_flat_walls_hold_the_field(container: Container, fields: tuple[int, ...]) -> None:
    """Nodes on floor, mirrors and walls of a box stay; affine fields that are left vanish there."""
    position, _ = bed(count=300)
    _, node, _ = elements(container, position[-1])
    for axis, count in enumerate(fields):
        free, affine = admissible(container, node, axis)
        assert affine.shape == (len(free), count)
        if count == 1:
            assert (node[free, axis] > 0).all()
            ratio = affine[:, 0] / node[free, axis]
            np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_all_modes_together_are_the_papers_estimate() -> None:
    """Four instants have at most three modes: their sum is each grain's own law, any weights."""
    position, _ = bed(count=40)
    position, cycle = position[:4], CYCLE[:4]
    for weight in (np.ones(40), np.random.default_rng(0).uniform(0.1, 2, 40)):
        modes = modal_moves(cycle, position, LOG, 60.0, weight)
        expected = law_moves(cycle, position, LOG, 60.0 - cycle[-1])
        np.testing.assert_allclose(modes.sum(axis=0), expected, atol=1e-9 * np.abs(expected).max())


def test_profile_keeps_fluctuations() -> None:
    """Grains at one height move down alike; outwards they move in proportion to their distance."""
    position, radius = bed(4, count=300)
    move = moved(move_named("profile"), position, radius)
    ratio = move[:, :2] / position[-1, :, :2]
    np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-9)
    order = np.argsort(position[-1, :, 2])
    height, drop = position[-1, order, 2], move[order, 2]
    slope = np.diff(drop) / np.diff(height)
    assert (
        len(np.unique(np.round(slope / np.abs(slope).max(), 6))) <= 12
    )  # 4 layers, rounding apart


def test_fence_is_tukeys() -> None:
    """Lengths exp(0 ... 1) have quartiles 1/4 and 3/4 of the logarithm: the fence is past them all;
    a thousandfold one is cut to exp(3/4 + 1.5 / 2)."""
    length = np.exp(np.linspace(0, 1, 4001))
    assert upper_fence(length) == pytest.approx(np.e)
    assert upper_fence(np.append(length, 1e3)) == pytest.approx(np.exp(1.5), rel=1e-3)
    assert upper_fence(np.zeros(3)) == 0


@every_way
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"h": -1.0}, "a jump of -1 cycles"),
        ({"h": np.nan}, "a jump of nan"),
        ({"radius": np.ones(59)}, "not those of states of the same grains"),
        ({"position": np.zeros((21, 0, 3)), "radius": np.ones(0)}, "no grains"),
    ],
)
def test_arguments_out_of_range_are_refused(
    way: Move, change: dict[str, object], message: str
) -> None:
    """Each argument that makes no sense is named, by every way."""
    position, radius = bed()
    arguments = {"cycle": CYCLE, "position": position, "radius": radius, "law": LOG, "h": 30.0}
    with pytest.raises(UsageError, match=message):
        way.displacement(**(arguments | change), container=QUARTER)  # type: ignore[arg-type]


@extrapolating
def test_damaged_position_is_named(way: Move) -> None:
    """A position that is not finite stops the jump."""
    position, radius = bed()
    position[7, 4, 1] = np.nan
    with pytest.raises(UsageError, match="not finite"):
        moved(way, position, radius)


@every_way
@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_grains_move_too(way: Move, count: int) -> None:
    """One grain, two, a handful: finite moves, the mean kept."""
    position, radius = bed(count=count)
    move = moved(way, position, radius)
    assert np.isfinite(move).all()
    if way.name != "still":
        expected = law_moves(CYCLE, position, LOG, 30)[:, 2].mean()
        assert move[:, 2].mean() == pytest.approx(expected, rel=1e-9)


# --- in a scene -----------------------------------------------------------------------------------


@every_way
def test_a_run_with_each_way(way: Move, tmp_path: Path) -> None:
    """Two jumps on the engine that settles by a formula, u ~ z ln(1 + N): it is met within 3 %.

    Smoothing bends that field at the border of sixty grains; who moves nothing lacks the jumps.
    """
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=10, h=8, total_cycles=50))
    run_scene(scene, tmp_path / "run", overrides=[f'procedure.move="{way.name}"'], progress=QUIET)
    with (tmp_path / "run" / "settlement.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    settled = float(rows[-1]["settlement"]) / (SETTLEMENT * np.log(51))
    assert [row["kind"] for row in rows].count("jumped") == 2
    assert settled == pytest.approx(1.0, rel=0.03) or (way.name == "still" and settled < 0.95)


def test_a_run_settled_by_its_history(tmp_path: Path) -> None:
    """Jumps settle the mean grain by the slopes of all cycles, u ~ ln(1 + N) here: met within 3 %.

    The gain that is asked for is in the record of each jump, and relaxation moves it by little.
    """
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=10, h=8, total_cycles=50))
    overrides = ['procedure.settlement="history"']
    run_scene(scene, tmp_path / "run", overrides=overrides, progress=QUIET)
    with (tmp_path / "run" / "settlement.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[-1]["settlement"]) == pytest.approx(SETTLEMENT * np.log(51), rel=0.03)
    settled = {int(row["cycle"]): float(row["settlement"]) for row in rows}
    jumps = [one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump"]
    assert len(jumps) == 2
    for one in jumps:
        exact = SETTLEMENT * np.log((one.last_cycle + 1) / (one.first_cycle + 1))
        assert one.notes["gain"] == pytest.approx(exact, rel=0.1)
        before = settled[one.first_cycle]
        assert one.rows[0]["settlement"] - before == pytest.approx(one.notes["gain"], rel=0.1)


def test_scene_without_the_key_is_the_scene_of_older_runs(tmp_path: Path) -> None:
    """At its default the key is left out of the record; another way is kept, and refused later."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=4, h=2, total_cycles=12))
    usual, named, other = (
        scene_record(scene_load(scene, overrides))["procedure"]
        for overrides in ([], ['procedure.move="smoothed"'], ['procedure.move="shrunk"'])
    )
    assert "move" not in usual
    assert usual == named
    assert other == usual | {"move": "shrunk"}
    run_scene(scene, tmp_path / "run", progress=QUIET)
    with pytest.raises(SceneError, match=r"procedure\.move: None in the run, 'shrunk' now"):
        run_scene(scene, tmp_path / "run", overrides=['procedure.move="shrunk"'], progress=QUIET)
