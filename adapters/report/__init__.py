"""The report of a run: numbers, figures, verdict."""

from adapters.report.drawing import WIDTH
from adapters.report.page import write_report

__all__ = [
    "WIDTH",
    "write_report",
]
