"""Pages of the documentation from their templates and records."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

MARK = re.compile(r"<[A-Z][A-Z0-9_]*>|\{\{\w+\}\}")


def page_filled(template: str, parts: Mapping[str, str]) -> str:
    """A template whose marks ``{{NAME}}`` and ``<NAME>`` give way to the part of that name.

    ValueError where there is no such mark, as a table would be made for no page, or no such part.
    """
    for name, part in parts.items():
        marks = ("{{" + name + "}}", f"<{name}>")
        if not any(mark in template for mark in marks):
            raise ValueError(f"the template has no mark for {name}")
        for mark in marks:
            template = template.replace(mark, part)
    if left := MARK.search(template):
        raise ValueError(f"no part for the mark {left.group()}")
    return template


def table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *lines])
