"""A run as files of other programs: ParaView, OVITO, CAD, tables."""
