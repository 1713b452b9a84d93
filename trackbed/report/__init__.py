"""The page and the figures that all reports share."""

from trackbed.report.figure import STYLE, encode_figure, save_figure
from trackbed.report.page import (
    MINUS,
    TIMES,
    format_number,
    format_share,
    format_um,
    format_verdict,
    make_folded,
    make_list,
    make_page,
    make_paragraph,
    make_picture,
    make_section,
    make_table,
    mark_number,
    write_run_page,
)

__all__ = [
    "MINUS", "STYLE", "TIMES", "encode_figure", "format_number", "format_share", "format_um",
    "format_verdict", "make_folded", "make_list", "make_page", "make_paragraph", "make_picture",
    "make_section", "make_table", "mark_number", "save_figure",
    "write_run_page",
]  # fmt: skip
