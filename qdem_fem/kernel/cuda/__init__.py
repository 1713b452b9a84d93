"""The step of the elements on a GPU."""

from qdem_fem.kernel.cuda.assembly import CudaAssembly, require_gpu
from qdem_fem.kernel.cuda.step import AGAIN, DEEP, LIMIT, choose_grid, cuda
from qdem_fem.kernel.cuda.sums import sum_before

__all__ = [
    "AGAIN", "DEEP", "LIMIT", "CudaAssembly", "choose_grid", "cuda", "require_gpu", "sum_before",
]  # fmt: skip
