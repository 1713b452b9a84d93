"""Pieces of a report's page: well-formed HTML, self-contained, readable on paper."""

import base64
import json
from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any

from trackbed.run_files import write_whole

STYLE = Path(__file__).with_suffix(".css")
"""Style sheet of every page, which is put into it."""
TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
MINUS, TIMES, UNKNOWN = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}"
"""Signs as in print, and what stands for a number that is not known."""


def make_page(title: str, body: Iterable[str]) -> str:
    """A whole page; the policy in its head forbids it to load anything."""
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8"/>',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}"/>',
            '<meta name="viewport" content="width=device-width, initial-scale=1"/>',
            '<link rel="icon" href="data:,"/>',
            f"<title>{escape(title)}</title>",
            f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>",
            "</head>",
            "<body>",
            *body,
            "</body>",
            "</html>\n",
        ]
    )


def write_run_page(
    folder: Path, title: str, claim: str, pictures: Iterable[tuple[Path | None, str]],
    rows: Iterable[Sequence[str]], left_out: Iterable[str], provenance: dict[str, Any],
) -> Path:  # fmt: skip
    """Write ``report.html`` in the folder of a run; its path.  Raises as `write_whole`.

    A ``claim`` in sentences, ``pictures`` with their captions, ``rows`` of figures (HTML), physics
    that is ``left_out``, and how to make the run again.
    """
    parts = [
        f"<h1>{escape(title)}</h1>",
        make_paragraph(escape(claim), "claim"),
        *(make_picture(path, caption, escape(caption)) for path, caption in pictures),
        make_section("Figures", make_table("", (), rows)),
        make_section("Left out", make_list(map(escape, left_out))),
        make_section("Again", f"<pre>{escape(json.dumps(provenance, indent=1))}</pre>"),
    ]
    path = folder / "report.html"
    write_whole(path, make_page(title, parts))
    return path


def mark_number(value: float | None, text: str) -> str:
    """A number as ``text``, its full value beside it for machines; a dash when not known."""
    if value is None or not isfinite(value):
        return UNKNOWN
    return f'<data value="{float(value)!r}">{_typeset(text)}</data>'


def _typeset(text: str) -> str:
    """Minus signs and powers of ten as in print."""
    mantissa, exponent, power = escape(text).partition("e")
    if mantissa.startswith("-"):
        mantissa = MINUS + mantissa[1:]
    if exponent and power.lstrip("+-").isdigit():
        return f"{mantissa} {TIMES} 10<sup>{str(int(power)).replace('-', MINUS)}</sup>"
    return mantissa + exponent + power


def format_um(value: float, form: str = ".1f") -> str:
    """A length in m, shown in micrometres without the unit."""
    return mark_number(value, f"{1e6 * value:{form}}")


def format_share(value: float, form: str = "+.1f") -> str:
    """A share of one, shown in per cent with its sign."""
    return mark_number(value, f"{100 * value:{form}} %")


def format_number(value: float, form: str) -> str:
    """Any number in a format."""
    return mark_number(value, f"{value:{form}}")


def format_verdict(ok: bool | None) -> str:
    """Whether a bar is met."""
    if ok is None:
        return UNKNOWN
    return '<span class="yes">met</span>' if ok else '<span class="no">missed</span>'


def make_section(title: str, *parts: str) -> str:
    """A heading and what stands below it."""
    return "\n".join([f"<h2>{escape(title)}</h2>", *parts])


def make_paragraph(text: str, kind: str = "") -> str:
    """A paragraph of HTML ``text``."""
    return f'<p class="{kind}">{text}</p>' if kind else f"<p>{text}</p>"


def make_list(items: Iterable[str]) -> str:
    """A list of HTML items."""
    return "<ul>" + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


def make_table(
    caption: str, header: Sequence[str], rows: Iterable[Sequence[str]], marked: str = "",
    words: frozenset[int] = frozenset(),
) -> str:  # fmt: skip
    """A table of HTML cells; the row whose first cell is ``marked`` stands out.

    ``words``: columns of text, set flush left.
    """

    def join_cells(tag: str, cells: Sequence[str]) -> str:
        kinds = (' class="words"' if place in words else "" for place in range(len(cells)))
        pairs = zip(kinds, cells, strict=True)
        return "".join(f"<{tag}{kind}>{cell}</{tag}>" for kind, cell in pairs)

    lines = ['<div class="scroll"><table>']
    if caption:
        lines.append(f"<caption>{caption}</caption>")
    if header:
        lines.append(f"<thead><tr>{join_cells('th', header)}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        kind = ' class="this"' if marked and row[0] == marked else ""
        lines.append(f"<tr{kind}>{join_cells('td', row)}</tr>")
    lines.append("</tbody></table></div>")
    return "\n".join(lines)


def make_picture(path: Path | None, description: str, caption: str) -> str:
    """The image file ``path`` inside the page; nothing for None."""
    if path is None:
        return ""
    content = base64.b64encode(path.read_bytes()).decode("ascii")
    source = f"data:{TYPES[path.suffix]};base64,{content}"
    return (
        f'<figure><img alt="{escape(description)}" src="{source}"/>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def make_folded(summary: str, content: str) -> str:
    """Content that opens on a click."""
    return f"<details><summary>{escape(summary)}</summary>{content}</details>"
