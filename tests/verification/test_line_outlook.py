"""What a run of a line says of the work that is left is what is left, whatever its law."""

from __future__ import annotations

import numpy as np
import pytest

from track_line.laws import list_laws
from track_line.scene.file import load_scene
from track_line.scene.run import RunFolder, run_scene
from trackbed.scenes import find_scene_file

LINES = 2


@pytest.mark.parametrize("name", list_laws())
def test_blocks_left_are_those_that_come(name, tmp_path):
    """At every block of 1e7 axles what is left is within a tenth, or two blocks, of what comes, as
    the mean stiffness of one short line is of the run's: by N^0.2 alone it was a third of it, where
    a constant rate lets stability decide.  The check of both lines by half the blocks takes twice
    as many again, and is counted."""
    said: list[tuple[float, float]] = []
    sets = ("line.axles=1e7", "line.length=60", f"line.realisations={LINES}", "scatter.length=3.0")
    file = load_scene(find_scene_file("line"), [*sets, f'law={{name="{name}"}}'])
    records, _ = run_scene(file, RunFolder(tmp_path), resume=False,
                           progress=lambda done, total, _: said.append((done, total)))  # fmt: skip
    blocks = len(records) - 1
    done, total = np.array(said).T
    assert set(total) == {total[0]}
    assert done[0] == 0
    assert done[-1] == pytest.approx(total[0])
    left, comes = (total - done)[: blocks + 1], len(said) - 2 - np.arange(blocks + 1)
    assert left == pytest.approx(comes, rel=0.1, abs=2)
    assert 3 * blocks == pytest.approx(total[0], rel=0.1)
