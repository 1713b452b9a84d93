"""A scene run from its file: build, march, report."""

from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from qdem_fem.scene.doubts import warn_of_bending
from qdem_fem.scene.page import write_report
from qdem_fem.scene.run import RunFolder, make_plan, run_dynamic, run_static
from qdem_fem.scene.summary import (
    describe_critical_step,
    list_body_facts,
    list_mass_scaling_facts,
    summarise_run,
)

__all__ = [
    "RunFolder", "describe_critical_step", "list_body_facts", "list_mass_scaling_facts",
    "load_scene", "make_plan", "make_simulation", "run_dynamic", "run_static", "summarise_run",
    "warn_of_bending", "write_report",
]  # fmt: skip
