"""A run as files of other programs: ParaView, OVITO, tables."""

from adapters.report.export.formats import export_run
from adapters.report.export.instants import read_exported_run

__all__ = ["export_run", "read_exported_run"]
