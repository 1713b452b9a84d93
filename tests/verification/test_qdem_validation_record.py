"""The record of the validation of QDEM: kept parts, the code behind them, page and picture."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from validation import qdem_record, qdem_validation_page, qdem_validation_picture
from validation.case import Check
from validation.cases import qdem
from validation.qdem_record import Outcome, table_read, table_write


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Two parts that do nothing but count their runs."""
    ran: list[str] = []

    def part(name: str) -> Outcome:
        ran.append(name)
        checks = [Check("a", float(len(ran)), "reported", True, "m"), Check("b", np.nan, "", False)]
        return Outcome(checks, {name: {"time [s]": np.arange(3), "kind": ["x", "y", "z"]}})

    monkeypatch.setattr(
        qdem, "FULL", {"some": lambda: part("some"), "other": lambda: part("other")}
    )
    monkeypatch.setattr(qdem, "CODE", {"some": "1", "other": "1"})
    return ran


def test_a_part_is_computed_once(tmp_path: Path, counted: list[str]) -> None:
    """Done parts are read, not computed, and say which code made them."""
    path = tmp_path / "qdem.jsonl"
    qdem.part_recorded("other", path)
    first = qdem.part_recorded("some", path)
    again = qdem.part_recorded("some", path)
    assert counted == ["other", "some"]
    assert [(c.name, c.value, c.holds) for c in again[:1]] == [("a", 2.0, True)]
    assert np.isnan(first[1].value)
    assert np.isnan(again[1].value)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["part"] for line in lines] == ["some", "other"]
    assert {"code", "commit", "command", "machine", "versions", "cpu_s"} <= lines[0].keys()


def test_a_part_of_earlier_code_is_shown_and_said_to_be_so(
    tmp_path: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not lost, nor passed off as made by this code; redone when asked."""
    path = tmp_path / "qdem.jsonl"
    qdem.part_recorded("some", path)
    monkeypatch.setattr(qdem, "CODE", {"some": "2", "other": "2"})
    assert qdem.part_recorded("some", path)[0].name == "a (made by earlier code)"
    assert "earlier code" in qdem.parts_table(path)
    assert "not computed yet" in qdem.parts_table(path)
    qdem.part_computed("some", path)
    assert qdem.part_recorded("some", path)[0].name == "a"
    assert counted == ["some", "some"]


def test_tables_come_back_as_they_were_written(tmp_path: Path) -> None:
    """Numbers to nine digits, and words."""
    path = tmp_path / "qdem.jsonl"
    value = np.random.default_rng(1).normal(size=4)
    table_write("t", {"u [m]": value, "kind": list("abcd"), "n": range(4)}, path)
    back = table_read("t", path)
    np.testing.assert_allclose(back["u [m]"], value, rtol=1e-8)
    assert list(back["kind"]) == list("abcd")
    np.testing.assert_array_equal(back["n"], range(4))


def test_a_table_of_unequal_columns_is_refused(tmp_path: Path) -> None:
    """And nothing is left on the disk."""
    with pytest.raises(ValueError, match="shorter"):
        table_write("t", {"a": [1, 2], "b": [1]}, tmp_path / "qdem.jsonl")
    assert list(tmp_path.iterdir()) == []


# --- the code behind a part -------------------------------------------------------------------


@pytest.mark.parametrize("part", qdem.FULL)
def test_every_part_depends_on_the_kernel_and_on_its_own_module(part: str) -> None:
    """And not on how things are told or drawn."""
    module = qdem.FULL[part].__module__
    behind = qdem_record.modules_behind(module)
    assert {module, "qdem_fem.kernel", "qdem_fem.stress", "qdem_fem.simulation"} <= behind
    assert not behind & {"qdem_fem.errors", "qdem_fem.cli", "validation.qdem_record"}


def test_the_digest_sees_statements_and_no_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Comments, docstrings and layout may change; a number may not, nor one in an import."""
    monkeypatch.setattr(qdem_record, "ROOT", tmp_path)
    folder = tmp_path / "qdem_fem"
    folder.mkdir()

    def digest(one: str, other: str) -> str:
        (folder / "one.py").write_text(one)
        (folder / "other.py").write_text(other)
        qdem_record._imported.cache_clear()
        qdem_record._statements.cache_clear()
        return qdem_record.code_digest("qdem_fem.one")

    base = digest("from qdem_fem.other import f\ny = f(1)\n", "def f(x):\n    return 2 * x\n")
    assert base == digest(
        "'Words.'\nfrom qdem_fem.other import f\ny = f( 1 )  # why\n",
        "def f(x):\n    'More.'\n    return 2 * x\n",
    )
    assert base != digest(
        "from qdem_fem.other import f\ny = f(2)\n", "def f(x):\n    return 2 * x\n"
    )
    assert base != digest(
        "from qdem_fem.other import f\ny = f(1)\n", "def f(x):\n    return 3 * x\n"
    )
    qdem_record._imported.cache_clear()
    qdem_record._statements.cache_clear()


# --- page and picture -------------------------------------------------------------------------


def test_the_page_looks_its_figures_up() -> None:
    """A changed record changes the table; a check that fails is said to; what lacks is said to."""
    point = qdem_validation_page.Point("tip", "static", ("tip",), "how")
    good = {"static": [Check("tip", 2e-6, "< 1e-05", True)]}
    bad = {"static": [Check("tip", 2e-5, "< 1e-05", False)]}
    row = qdem_validation_page.point_row
    assert row(good, point) == "| tip | < 1e-05 | 2e-06 | how |"
    assert "**fails**" in row(bad, point)
    assert "not computed" in row({}, point)
    with pytest.raises(KeyError, match="tip"):
        row({"static": []}, point)


def test_the_worst_of_several_is_shown() -> None:
    """One that fails before any that holds; of orders the least."""
    checks = [Check("a", 3.0, "< 4", True), Check("b", 1.0, "< 4", False)]
    assert qdem_validation_page.worst(checks).name == "b"
    assert qdem_validation_page.worst(checks[:1] * 2).name == "a"
    pair = [Check("order", 1.9, "1.8 to 2.2", True), Check("order", 2.1, "1.8 to 2.2", True)]
    assert qdem_validation_page.worst(pair).value == 1.9


def test_every_figure_of_the_words_is_of_a_known_part() -> None:
    """No part is misspelt in the words of the page, nor in its table."""
    words = qdem_validation_page.WORDS.read_text(encoding="utf-8")
    named = {match[0] for match in qdem_validation_page.FIGURE.findall(words)}
    named |= {point.part for point in qdem_validation_page.POINTS}
    assert named <= qdem.FULL.keys()
    assert "[[" not in re.sub(qdem_validation_page.FIGURE, "", words)


def test_the_picture_is_drawn_from_whatever_is_recorded(tmp_path: Path) -> None:
    """With no table at all every panel says so, and the file is a picture."""
    qdem_validation_picture.draw(tmp_path / "qdem.jsonl", tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    assert [path.name for path in tmp_path.iterdir()] == ["p.png"]
