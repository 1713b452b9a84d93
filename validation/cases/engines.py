"""Chung and Ooi's eight single impacts on every engine that is installed.

Force-displacement curve, contact time, restitution, friction impulses and spins against closed
forms (tests 1 to 3 within 1 %, 4 to 8 within 2 %), against each engine's own law integrated on
paper, partial slip and published curves, and against what each engine gave before.

    trackbed validate engines            both materials of each test
    trackbed validate engines --quick    the first material, two restitutions
"""

from __future__ import annotations

from adapters.engine import engine_named
from adapters.engine_names import REAL_ENGINES
from adapters.errors import EngineMissing
from validation.case import Check
from validation.chung_ooi import NORMAL, RESTITUTION, TANGENTIAL
from validation.chung_ooi_checks import (
    ORDERS,
    Measured,
    closing_checks,
    lever_check,
    normal_checks,
    order_check,
    regression_check,
    restitution_checks,
    tangential_checks,
    tangential_order_checks,
)
from validation.chung_ooi_curves import published_checks


def engines_present() -> list[str]:
    """Names of the engines with mechanics that are installed; raises `EngineMissing` if none is."""
    present = []
    for name in REAL_ENGINES:
        try:
            engine_named(name).version()
        except EngineMissing:
            continue
        present.append(name)
    if not present:
        raise EngineMissing("no engine is installed, so there is nothing to validate")
    return present


def measure(engine: str, quick: bool) -> tuple[list[Check], Measured]:
    """The analytic checks of one engine, and what was measured for them."""
    part = 2 if quick else 1
    measured: Measured = {}
    checks = [c for s in NORMAL[::part] for c in normal_checks(s, engine, measured)]
    settings = RESTITUTION[1:4:2] if quick else RESTITUTION
    checks += restitution_checks(settings, engine, measured)
    checks += [order_check(engine, restitution) for restitution in ORDERS]
    checks += tangential_order_checks(engine)
    checks += [c for s in TANGENTIAL[::part] for c in tangential_checks(s, engine, measured)]
    checks += [*closing_checks(engine), lever_check(TANGENTIAL[3], engine)]
    return checks, measured


def run(quick: bool) -> list[Check]:
    """All tests on all engines: some minutes, half of it when ``quick``."""
    checks = published_checks()
    for engine in engines_present():
        found, measured = measure(engine, quick)
        checks += [*found, regression_check(engine, measured)]
    return checks
