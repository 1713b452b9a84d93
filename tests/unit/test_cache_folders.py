"""What numba and matplotlib keep where neither installation nor home can be written to."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from trackbed import cache_folders

ROOT = Path(__file__).parents[2]
WRITES_ONLY_IN = """
import os, sys

def refuse(event, arguments, allowed=sys.argv.pop(1)):
    writes = event == "os.mkdir"
    if event == "open" and isinstance(arguments[2], int):
        writes = arguments[2] & (os.O_WRONLY | os.O_RDWR)
    path = arguments[0] if writes and isinstance(arguments[0], str) else allowed
    if not (os.path.abspath(path).startswith(allowed) or path.startswith("/dev/")):
        raise PermissionError(13, "Permission denied", path)

sys.addaudithook(refuse)
"""
"""A process that can make files in one folder only, root or not."""
KERNELS = (
    "adapters.relaxation.kernel, qdem_fem.kernel.cpu.step, rigid_lcp.friction.problem.cones, "
    "track_line.beam.kernel"
)


def run_without_home(code: str, folder: Path) -> str:
    """What a process prints that can write to ``folder`` only; it is also the temporary one."""
    left_out = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR")
    environment = {name: word for name, word in os.environ.items() if name not in left_out}
    run = subprocess.run(
        [sys.executable, "-c", WRITES_ONLY_IN + code, str(folder)], cwd=ROOT, capture_output=True,
        env=environment | {"HOME": "/nonexistent", "TMPDIR": str(folder)}, text=True,
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout.strip()


@pytest.mark.long
@pytest.mark.parametrize("numba_first", [True, False])
def test_kernels_are_defined_and_pictures_drawn(tmp_path: Path, numba_first: bool) -> None:
    """numba refuses to define a kernel that it can keep nowhere: it is given a private folder."""
    code = f"import {KERNELS}, matplotlib.pyplot\nprint(os.environ['NUMBA_CACHE_DIR'])"
    found = run_without_home("import numba\n" * numba_first + code, tmp_path)
    folder = tmp_path / f"trackbed-cache-{os.getuid()}"
    assert found == str(folder)
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.long
def test_kernels_are_kept(tmp_path: Path) -> None:
    """A second process finds what the first compiled."""
    code = (
        "import numpy as np\nfrom adapters.files.dump_kernel import round_to_bits\n"
        "round_to_bits(np.uint64(1), np.int64(0))\n"
        "print(sum(round_to_bits.stats.cache_hits.values()))"
    )
    assert [run_without_home(code, tmp_path) for _ in range(2)] == ["0", "1"]


@pytest.mark.parametrize("taken", ["link", "open to others", "file"])
def test_taken_name_is_unused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: str) -> None:
    """Whoever can write to the folder can run programs as this user."""
    monkeypatch.setattr(cache_folders.tempfile, "tempdir", str(tmp_path))
    path = tmp_path / f"trackbed-cache-{os.getuid()}"
    if taken == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        path.symlink_to(tmp_path / "elsewhere")
    elif taken == "file":
        path.write_text("")
    else:
        path.mkdir()
        path.chmod(0o770)
    found = Path(cache_folders.make_private_folder())
    assert found != path
    assert found.stat().st_mode & 0o777 == 0o700


def test_a_writable_installation_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels stay beside their sources, or in the user's cache."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "__init__.py").write_text("")
    cache_folders.provide_cache_folders(str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(cache_folders, "can_write", lambda folder: folder.endswith("cache/numba"))
    cache_folders.provide_cache_folders(str(tmp_path))
    assert "NUMBA_CACHE_DIR" not in os.environ
