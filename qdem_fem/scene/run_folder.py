"""What is in the folder of a QDEM run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from trackbed.run_files import RESULT, record_provenance
from trackbed.run_files import folder as run_folder

__all__ = ["CHECKPOINT", "RESULT", "RunFolder", "make_manifest"]

CHECKPOINT = "checkpoint.npz"


class RunFolder(run_folder.RunFolder):
    """The folder of one QDEM run; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, CHECKPOINT, "cost.json", "probes.csv",
        "energy.csv", "fields.pvd", "fields_*.vtu", "report.html", "picture-*.png", "video.gif",
        ".*.partial",
    )  # fmt: skip
    states = CHECKPOINT
    compared = ("scene", "files")
    free: ClassVar[tuple[str, ...]] = (
        "scene.title", "scene.simulation.threads", "scene.output.checkpoint_interval",
        "scene.output.audit", "scene.output.modes", "scene.output.video",
    )  # fmt: skip

    @property
    def finished(self) -> bool:
        """Whether the run came to its end, report and all."""
        return self.summary is not None

    @property
    def checkpoint(self) -> Path:
        """Where the last saved state is."""
        return self.path / CHECKPOINT


def make_manifest(
    parameters: dict[str, Any], files: dict[str, str], overrides: Sequence[str], argv: Sequence[str]
) -> dict[str, Any]:
    """What a result can be made again from: effective scene, files, versions, machine, command."""
    made = {"scene": parameters, "files": files, "overrides": list(overrides)}
    return dict(json.loads(json.dumps(made | record_provenance(argv))))
