"""The report of a run: numbers, figure, verdict."""

from adapters.report.figure import add_legend, draw_members, make_panels
from adapters.report.page import write_brief_report, write_report

__all__ = ["add_legend", "draw_members", "make_panels", "write_brief_report", "write_report"]
