"""Where numba.cuda can not be imported, for whatever reason: a sentence, and no test breaks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import qdem_fem as q
from qdem_fem.files.errors import LibraryMissing

ROOT = Path(__file__).parents[2]
SCENE = (ROOT / "trackbed" / "scenes" / "cantilever-vibration.toml").read_text()
WITHOUT_RUNTIME = r"""
import importlib.abc, sys

class NoRuntime(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "numba.cuda":
            raise {error}("libcudart.so.12: cannot open\nshared object file")

for name in [name for name in sys.modules if name.startswith("numba.cuda")]:
    del sys.modules[name]
sys.meta_path.insert(0, NoRuntime())
"""
"""numba-cuda's own behaviour on a machine without CUDA's runtime: the import raises."""


@pytest.mark.long
@pytest.mark.parametrize("error", ["OSError", "ImportError", "RuntimeError"])
def test_a_scene_on_a_gpu_ends_in_a_sentence(tmp_path: Path, error: str) -> None:
    """What, where, what to do; exit code 4 and no traceback."""
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("[simulation]", '[simulation]\ndevice = "cuda"'))
    code = WITHOUT_RUNTIME.format(error=error) + (
        "from trackbed.command import main\nsys.exit(main(['qdem', sys.argv[1]]))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, str(scene)], cwd=ROOT, capture_output=True, text=True
    )
    assert run.returncode == 4, run.stderr
    assert run.stderr == (
        'trackbed: device="cuda": numba.cuda can not be imported (libcudart.so.12: cannot open '
        "shared object file)\n  -> pip install 'trackbed[cuda]' beside an NVIDIA GPU, "
        'or compute with device="cpu"\n'
    )


@pytest.mark.long
def test_tests_of_the_gpu_are_skipped_with_the_reason(tmp_path: Path) -> None:
    """Collecting and running them raises nothing, and nothing of theirs is imported."""
    hook = tmp_path / "no_cuda_runtime.py"
    hook.write_text(WITHOUT_RUNTIME.format(error="OSError"))
    code = (
        "import sys; sys.path.insert(0, sys.argv.pop(1)); import no_cuda_runtime, pytest\n"
        "sys.exit(pytest.main(sys.argv[1:]))"
    )
    tests = [str(ROOT / "tests" / "verification" / name) for name in CUDA_TESTS]
    run = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), *tests, "-q", "-p", "no:cacheprovider"],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-2000:]
    assert "numba.cuda can not be imported (libcudart.so.12" in run.stdout
    assert "passed" not in run.stdout


CUDA_TESTS = ("test_qdem_cuda.py", "test_qdem_cuda_search.py")


def test_missing_library_is_said_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same from Python."""
    tetrahedron = q.Body(([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]]), CONCRETE)
    monkeypatch.setitem(sys.modules, "numba.cuda", None)
    for module in [one for one in sys.modules if one.startswith("qdem_fem.kernel.cuda")]:
        monkeypatch.delitem(sys.modules, module)
    with pytest.raises(LibraryMissing) as caught:
        q.Simulation([tetrahedron], device="cuda")
    assert "pip install 'trackbed[cuda]'" in caught.value.remedy
    assert caught.value.exit_code == 4


CONCRETE = q.Material(young=45e9, poisson=0.167, density=2350.0)


ACCEPTANCE = r"""
import sys, tempfile
from pathlib import Path

class Bare:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("pydantic", "pydantic_core", "meshio", "skfem", "matplotlib"):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Bare())
from validation.case import Check
from validation.cases.qdem_gpu import compare_two, set_conditions
from validation.gpu_acceptance import run_stages

def twin():
    return [Check("twin", compare_two("finger", "float64", False, set_conditions), "<= 1", True)]

with tempfile.TemporaryDirectory() as folder:
    record = Path(folder) / "record.jsonl"
    stages = {"twin": twin, "broken": lambda: 1 / 0, "late": twin}
    assert not run_stages(stages, record, 9.0)
    rows = record.read_text().splitlines()
    assert '"value"' in rows[0] and "ZeroDivisionError" in rows[1] and '"value"' in rows[2]
    assert run_stages({"late": twin}, record, -1.0)
    assert "skipped" in record.read_text().splitlines()[3]
"""


@pytest.mark.long
def test_the_acceptance_of_a_gpu_needs_no_other_package() -> None:
    """In numba's simulator, as on a machine that has numba, NumPy and SciPy alone; a stage that
    fails is named, and the next one goes on."""
    variables = os.environ | {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", ACCEPTANCE], cwd=ROOT, env=variables, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
