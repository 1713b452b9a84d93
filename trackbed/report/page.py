"""Pieces of a report's page: well-formed HTML, self-contained, readable on paper."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite
from pathlib import Path

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 "Source Serif 4", Charter, Georgia, serif; color: #1a1a1a; background: #fff;
  max-width: 56rem; margin: 2.5rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .5rem; border-top: 1px solid #ccc; padding-top: .7rem; }
p, ul { margin: .55rem 0; }
.scene { color: #555; margin: 0 0 1.4rem; }
.claim { font-size: 1.12rem; border-left: 4px solid #0b5fa5; padding: .1rem 0 .1rem 1rem; }
.fails { border-left: 4px solid #e07b00; padding: .1rem 0 .1rem 1rem; }
.fails p { margin-bottom: 0; } .fails ul { margin-top: .2rem; }
figure { margin: 1.1rem 0; break-inside: avoid; }
figure img { width: 100%; height: auto; display: block; }
figcaption, caption { font-size: .87rem; color: #444; text-align: left; line-height: 1.4; }
caption { padding-bottom: .4rem; }
.scroll { overflow-x: auto; margin: 1.1rem 0; }
table { border-collapse: collapse; font: .84rem/1.35 "Source Sans 3", Helvetica, Arial, sans-serif;
  font-variant-numeric: tabular-nums; break-inside: avoid; width: 100%; }
th, td { padding: .28rem .5rem; text-align: right; vertical-align: top; }
td { white-space: nowrap; }
th { font-weight: 600; border-bottom: 1px solid #888; vertical-align: bottom; }
tbody tr { border-bottom: 1px solid #e4e4e4; }
th:first-child, td:first-child { text-align: left; padding-left: 0; white-space: nowrap; }
th.words, td.words { text-align: left; white-space: normal; }
tr.this td { font-weight: 700; background: #f1f6fb; }
td .error { display: inline-block; min-width: 4.4em; }
sub, sup { line-height: 0; }
.no { color: #b02020; font-weight: 600; } .yes { color: #1b6e3a; }
code, pre { font: .82rem/1.4 "Source Code Pro", Menlo, Consolas, monospace; }
pre { background: #f5f5f5; padding: .7rem .9rem; white-space: pre-wrap; overflow-wrap: anywhere; }
td code { overflow-wrap: anywhere; }
summary { cursor: pointer; color: #0b5fa5; }
@media print { body { font-size: 11pt; max-width: none; margin: 0; } h2 { break-after: avoid; }
  .scroll { overflow: visible; } table { font-size: 8.5pt; } }
"""

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
            f"<style>{STYLE}</style>",
            "</head>",
            "<body>",
            *body,
            "</body>",
            "</html>\n",
        ]
    )


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
    lines = ['<div class="scroll"><table>']
    if caption:
        lines.append(f"<caption>{caption}</caption>")
    if header:
        cells = "".join(
            f'<th class="words">{cell}</th>' if place in words else f"<th>{cell}</th>"
            for place, cell in enumerate(header)
        )
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        kind = ' class="this"' if marked and row[0] == marked else ""
        cells = "".join(
            f'<td class="words">{cell}</td>' if place in words else f"<td>{cell}</td>"
            for place, cell in enumerate(row)
        )
        lines.append(f"<tr{kind}>{cells}</tr>")
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
