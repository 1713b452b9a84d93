"""Names of the engines: that of NAME is the class ``NameEngine`` of ``adapters/engine_NAME.py``."""

from __future__ import annotations

from typing import Literal, get_args

EngineName = Literal["auto", "liggghts", "lammps", "yade", "fake"]
"""What a scene may ask for; ``auto`` is the first of `REAL_ENGINES` that is installed, ``fake``
writes analytic states, for tests."""

ENGINES: tuple[str, ...] = get_args(EngineName)

REAL_ENGINES: tuple[str, ...] = tuple(name for name in ENGINES if name not in ("auto", "fake"))
"""Engines with mechanics, in the order in which ``auto`` asks for them."""
