"""The step of the elements on a GPU."""

from qdem_fem.kernel.cuda.assembly import CudaAssembly, require_gpu
from qdem_fem.kernel.cuda.scan import sums_before
from qdem_fem.kernel.cuda.step import AGAIN, DEEP, LIMIT, cuda, grid

__all__ = [
    "AGAIN", "DEEP", "LIMIT", "CudaAssembly", "cuda", "grid", "require_gpu", "sums_before",
]  # fmt: skip
