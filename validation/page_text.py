"""Pages of the documentation from their templates and records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence


def page_filled(template: str, parts: Mapping[str, str]) -> str:
    """A template whose marks ``{{NAME}}`` and ``<NAME>`` give way to the part of that name."""
    for name, part in parts.items():
        template = template.replace("{{" + name + "}}", part).replace(f"<{name}>", part)
    return template


def table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *lines])
