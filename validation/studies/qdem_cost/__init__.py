"""What does an error cost with QDEM, and with what a user would take in its place?

Two questions are asked of every method (`questions`): a slow bending of the paper's cantilever,
where implicit steps may be long, and a short pulse along the same bar, where none may.  Methods
(`methods`) are QDEM in double and single precision, central differences with an assembled matrix,
and Newmark's method on linear and on quadratic tetrahedra, each on several meshes and with several
steps.  Costs are processor time of one thread, the median of three runs, without making the mesh
and without compiling.  Errors are relative L2 distances over time to spectral elements, kept in
``bending.csv`` and ``pulse.csv`` (made by `git show 6035ef5:validation/qdem_work_reference.py`).

The part ``speed`` lets the kernel alone race against assembled matrices of scipy and of the Intel
MKL on 488,400 elements (`race`), beside the bandwidth of the machine.

Answer: docs/qdem-cost.md.
"""

ROOMS = "qdem_fem: bodies element kernel march"
