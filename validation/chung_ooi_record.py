"""Write the regression record: ``python -m validation.chung_ooi_record`` in a source checkout.

To be done by hand, after a change of an engine's release that is understood.
"""

from __future__ import annotations

from pathlib import Path

from validation.case import record_write
from validation.cases.engines import engines_present, measure
from validation.chung_ooi_checks import RECORDED

FOLDER = Path(__file__).parent / "results"

if __name__ == "__main__":
    content = {name: measure(name, quick=False)[1] for name in engines_present()}
    record_write(FOLDER / RECORDED, content)
