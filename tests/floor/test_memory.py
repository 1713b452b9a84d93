"""What would need more memory than there is, is refused before it is taken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.bed.state import load_state
from adapters.errors import UsageError
from qdem_fem.grains.sets import load_grains
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.files.formats import read_problem
from tests.small_bed import small_bed
from trackbed import memory
from trackbed.command import main
from trackbed.memory import measure_memory, read_arrays
from trackbed.run_files import read_object


def test_memory_is_what_the_system_says() -> None:
    """As the kernel's own table has it, or less in a container."""
    line = Path("/proc/meminfo").read_text().splitlines()[0]
    assert 0 < measure_memory() <= 1024 * int(line.split()[1]) * 1.01


@pytest.mark.parametrize(
    ("read", "error"),
    [(read_arrays, MemoryError), (load_grains, MemoryError), (load_state, UsageError),
     (read_problem, ProblemError)],
)  # fmt: skip
def test_packed_arrays_are_measured_before_they_are_unpacked(
    read: Callable[[Path], Any], error: type[Exception],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Ten million zeros are ten kilobytes in the file."""
    path = tmp_path / "state.npz"
    np.savez_compressed(path, scalars=np.zeros(10**7))
    assert path.stat().st_size < 10**5
    monkeypatch.setattr(memory, "measure_memory", lambda: 10**7)
    with pytest.raises(error, match=r"need 0.08 GB of memory, and there are 0.01"):
        read(path)


def test_a_record_that_is_too_long_can_not_be_read(tmp_path, monkeypatch) -> None:
    """Objects of Python take many times the bytes of JSON."""
    (tmp_path / "a.json").write_text('{"a": 1}')
    assert read_object(tmp_path / "a.json") == {"a": 1}
    monkeypatch.setattr(memory, "measure_memory", lambda: 100)
    assert read_object(tmp_path / "a.json") == {}


@pytest.mark.parametrize("key", ["sample.count=100000000", "procedure.k_i=99999999"])
def test_a_run_that_is_too_large_is_refused(key: str, tmp_path, capsys) -> None:
    """With the memory that it would need; exit code 5, and nothing is written."""
    (tmp_path / "scene.toml").write_text(small_bed(k=4, h=8, total_cycles=10**8))
    assert main(["run", str(tmp_path / "scene.toml"), "--set", key]) == 5
    assert "GB of memory" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
