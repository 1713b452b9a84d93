"""docs/settlement-ensemble.md is what its record says, and the record belongs together."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from adapters.overlaps import neighbours
from adapters.radii import radii_sample
from validation.settlement_ensemble import CONFINED, KINDS, Piece
from validation.settlement_ensemble_page import PAGE, page
from validation.settlement_ensemble_record import COLUMNS, EnsembleRecord
from validation.settlement_ensemble_runs import scene_digest

RECORD = EnsembleRecord()
KEPT = [
    piece for kind in KINDS.values() for piece in kind.runs() if RECORD.kept(piece.name) is not None
]


@pytest.mark.long
def test_page_is_made_from_the_record() -> None:
    """Made again, the page is the one that ships."""
    assert page(RECORD) == PAGE.read_text(encoding="utf-8")


def test_record_holds_what_its_tables_name_and_nothing_else() -> None:
    """A table, a checkpoint and states of each run; less than 10 MB a run."""
    files = {path.name for path in RECORD.path.iterdir()}
    for piece in KEPT:
        kept = RECORD.kept(piece.name)
        assert kept is not None
        mine = {f"{piece.name}.csv", kept.checkpoint.file, f"{piece.name}.states.npz"} & files
        assert sum((RECORD.path / name).stat().st_size for name in mine) < 10e6
        files -= mine
    assert not files


@pytest.mark.parametrize("piece", KEPT, ids=lambda piece: piece.name)
def test_run_can_go_on(piece: Piece) -> None:
    """Its checkpoint is the table's and a restart file; every cycle is there; the scene is ours."""
    kept = RECORD.kept(piece.name)
    assert kept is not None
    assert len(RECORD.restart(kept)) > 1e4
    assert kept.scene_sha256 == scene_digest(piece.kind.scene(piece.seed))
    table = RECORD.table(piece.name)
    assert table["cycle"].tolist() == list(range(piece.first + 1, kept.cycle + 1))
    assert np.isfinite(list(table.values())).all()
    assert kept.parts or piece.member is not None
    for before, after in zip(kept.parts, kept.parts[1:], strict=False):
        assert before["cycles"][1] == after["cycles"][0]


def test_first_window_is_that_of_an_earlier_record() -> None:
    """The same scene and seed, run before by ``trackbed run --control``: the same ten cycles.

    Both are one process from the same rain of grains; then the windows part.
    """
    with (RECORD.path.parent / "settlement-karrech.control.csv").open() as stream:
        before = [
            row for row, _ in zip(csv.DictReader(stream), range(CONFINED.window), strict=False)
        ]
    table = RECORD.table("confined-1")
    for name in ("settlement", "piston_height", "coordination_number", "elastic_deflection"):
        values = [float(row[name]) for row in before]
        digits = int(COLUMNS[name][1])
        np.testing.assert_allclose(
            table[name][: CONFINED.window], values, rtol=10.0 ** (1 - digits)
        )


@pytest.mark.parametrize("piece", KEPT, ids=lambda piece: piece.name)
def test_states_are_those_of_the_table(piece: Piece) -> None:
    """Mean height and coordination number of a kept state are those of its row."""
    kept, table = RECORD.kept(piece.name), RECORD.table(piece.name)
    assert kept is not None
    radius, positions = RECORD.states(piece.name)
    scene = piece.kind.scene(piece.seed)
    marks = {mark for mark in piece.kind.marks if piece.first < mark <= kept.cycle}
    assert set(positions) == marks | ({0} if piece.member is None else set())
    for cycle, position in positions.items():
        law = scene.sample.grain_radius.law
        np.testing.assert_allclose(radius, radii_sample(law, scene.grain_count, piece.seed))
        settlement = kept.mean_height - float(position[:, 2].mean())
        if cycle == 0:
            assert settlement == 0
            continue
        row = cycle - piece.first - 1
        # 7 digits of the table; the state itself is exact.
        assert settlement == pytest.approx(table["settlement"][row], rel=1e-6)
        walls = scene.container.walls(table["piston_height"][row], scene.piston_reach)
        pairs = int((neighbours(position, radius, walls).second >= 0).sum())
        assert 2 * pairs / len(radius) == pytest.approx(table["coordination_number"][row], rel=1e-6)


def test_sentences_about_the_piston_that_stands_on_few_grains() -> None:
    """Packing 2 of the partial bed: soft to cycle 40, a millimetre down to 54, then firm."""

    def column(packing: int, name: str) -> dict[int, float]:
        tables = [RECORD.table(f"partial-{packing}{member}") for member in ("", "-0")]
        pairs = [zip(table["cycle"], table[name], strict=True) for table in tables]
        return {int(cycle): float(value) for pair in pairs for cycle, value in pair}

    soft, firm, third = (column(packing, "piston_stiffness") for packing in (2, 1, 3))
    assert all(soft[cycle] < firm[cycle] / 10 for cycle in range(2, 41))
    assert all(column(2, "elastic_deflection")[cycle] > 9.9e-5 for cycle in range(1, 44))
    assert column(2, "force_error")[38] > 0.25
    height = column(2, "piston_height")
    assert height[38] - height[54] > 1e-3
    last = [np.mean([one[cycle] for cycle in range(61, 101)]) for one in (soft, firm, third)]
    assert max(last) < 1.1 * min(last)
