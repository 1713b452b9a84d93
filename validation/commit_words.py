"""Which code made the rows of a record, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any


def commit_short(commit: str) -> str:
    """Ten digits of a commit, and whether files of the checkout differed from it."""
    digits, _, modified = commit.partition("-")
    return f"`{digits[:10]}`" + (" with changed files" if modified else "")


def commit_words(rows: Iterable[Mapping[str, Any]]) -> str:
    """Commits of ``rows`` and their numbers of rows, the most frequent first."""
    counted = Counter(commit_short(row["commit"]) for row in rows)
    return ", ".join(f"{name} ({count:,})" for name, count in counted.most_common())
