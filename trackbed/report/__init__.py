"""The page and the figures that all reports share."""

from trackbed.report.figure import STYLE, encode_figure, save_figure
from trackbed.report.page import (
    MINUS,
    TIMES,
    bullets,
    folded,
    micrometres,
    page,
    paragraph,
    per_cent,
    picture,
    plain,
    section,
    table,
    verdict,
)

__all__ = [
    "MINUS", "STYLE", "TIMES", "bullets", "encode_figure", "folded", "micrometres",
    "page", "paragraph", "per_cent", "picture", "plain", "save_figure", "section", "table",
    "verdict",
]  # fmt: skip
