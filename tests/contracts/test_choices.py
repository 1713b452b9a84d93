"""Choices are found by being there."""

from __future__ import annotations

from pathlib import Path

import pytest

from trackbed.choices import find_choice, find_choices


def test_a_choice_is_added_by_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that sets the word of its folder is a choice; others are none, and no list is kept."""
    folder = tmp_path / "more_laws"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "square_root.py").write_text("LAW = 'the law'\n")
    (folder / "contract.py").write_text("class Law:\n    LAW = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert find_choices("more_laws", "LAW") == {"square-root": "more_laws.square_root"}
    assert find_choice("more_laws", "LAW", "square-root", "there is no law") == "the law"
