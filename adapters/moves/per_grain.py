"""Every grain by its own extrapolated law, as in the paper (section 3.2)."""

from adapters.moves.contract import Jump, Move

MOVE = Move("per-grain", Jump.extrapolate_grains, tames_loose=False)
"""Eqs 16 to 21.  Do not use it beyond comparisons: a few loose grains fly through their neighbours.
"""
