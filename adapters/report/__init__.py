"""The report of a run: numbers, figure, verdict."""

from adapters.report.figure import add_legend, make_panels
from adapters.report.page import write_report

__all__ = ["add_legend", "make_panels", "write_report"]
