"""The compiled step of the elements, on processors and on a GPU."""

from qdem_fem.kernel.compiling import digest_sources, exact, inlined

__all__ = [
    "digest_sources",
    "exact",
    "inlined",
]
