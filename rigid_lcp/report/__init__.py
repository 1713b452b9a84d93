"""Pictures and page of a run."""

from rigid_lcp.report.page import write_report

__all__ = ["write_report"]
