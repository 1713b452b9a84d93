"""Every kernel for a GPU, compiled to PTX for the cards of two generations; no card is needed.

numba's simulator runs kernels as Python and checks no types.  So one process runs all variants in
the simulator and keeps what each kernel was launched with, and another compiles them for that.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
CARDS = ((8, 0), (9, 0))  # compute capabilities of A100 and H100
BUILDERS = (
    ("qdem_fem.kernel.cuda.step", "build_element_forces"),
    ("qdem_fem.kernel.cuda.step", "build_node_motion"),
    ("qdem_fem.contact.cuda.law", "build_pairs_forces"),
    ("qdem_fem.contact.cuda.pairs", "build_rows_kernel"),
)
"""Functions that make kernels; all others are names of their modules."""
RECORD = f"""
import json, sys
from importlib import import_module
import numpy as np
from numba.cuda.simulator import kernel as simulator

launched, plain = {{}}, simulator.FakeCUDAKernel.__call__

def name_type(value):
    value = getattr(value, "_ary", value)
    if isinstance(value, np.ndarray):
        return [value.dtype.str, value.ndim]
    return [np.asarray(value).dtype.str, 0]

def launch(self, *values):
    if not self._device and not simulator._kernel_context:
        made = getattr(self, "made", (self.fn.__module__, self.fn.__name__, None))
        launched[json.dumps([made, [name_type(value) for value in values]])] = None
    return plain(self, *values)

simulator.FakeCUDAKernel.__call__ = launch
from qdem_fem.kernel.cuda import step
step.THREADS_A_BLOCK = 16
for module, name in {BUILDERS!r}:
    def build(*words, build=getattr(import_module(module), name), module=module, name=name):
        kernel = build(*words)
        kernel.made = (module, name, words)
        return kernel
    setattr(import_module(module), name, build)
from validation.cases.qdem_gpu import compare_twins
compare_twins()
print(json.dumps([json.loads(one) for one in launched]))
"""
COMPILE = """
import json, sys
from importlib import import_module
from types import SimpleNamespace
import numpy as np
from numba import cuda, types
from numba.cuda import dispatcher
from numba.np.numpy_support import from_dtype

launched, card = json.loads(sys.stdin.read()), tuple(map(int, sys.argv[1:]))
dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=card)
found = []
for (module, name, words), given in launched:
    kernel = getattr(import_module(module), name)
    if words is not None:
        kernel = kernel(*words)
    known = [from_dtype(np.dtype(kind)) for kind, _ in given]
    asked = tuple(types.Array(one, rank, "C") if rank else one
                  for one, (_, rank) in zip(known, given))
    text, _ = cuda.compile(kernel.py_func, asked, cc=card, device=False, output="ptx",
                           abi="numba")
    single = ["<f4", 2] in given
    found.append([name, words, single, text.count(".f64"), ".entry" in text])
print(json.dumps(found))
"""


def run_python(code: str, *words: str, given: str = "", **variables: str) -> Any:
    """What a process prints last, as JSON."""
    done = subprocess.run(
        [sys.executable, "-c", code, *words], input=given, cwd=ROOT, env=os.environ | variables,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.long
@pytest.mark.peer("nvidia.cuda_nvcc")
def test_every_kernel_compiles_for_two_generations_of_cards() -> None:
    """Elements in single precision compute nothing in double, but for what viscosity takes."""
    launched = run_python(RECORD, NUMBA_ENABLE_CUDASIM="1", NUMBA_NUM_THREADS="1")
    assert {name for (_, name, _), _ in launched} >= {name for _, name in BUILDERS}
    assert len(launched) > 40
    for card in CARDS:
        found = run_python(COMPILE, *map(str, card), given=json.dumps(launched))
        assert len(found) == len(launched)
        elements = [one for one in found if one[0] == "build_element_forces"]
        assert len(elements) == 12  # three strains, viscous or not, two precisions
        for _, (_, viscous), single, doubles, _ in elements:
            assert not single or doubles <= 5 * viscous
        assert all(entry for *_, entry in found)
