"""Which element for a body's mesh, and at what cost?

Linear and quadratic tetrahedra of the explicit step on three bodies: the paper's cantilever as it
bends and the same bar as a pulse runs along it (the questions of `validation.studies.qdem_cost`,
beside spectral elements), and a grain of flat faces squeezed between two of them.  Each has three
linear meshes, each half as fine as the next, and quadratic elements on the coarse ones and, of the
bar, on one that is coarser still.

Errors: of the history, relative L2 over time; of the grain, its force at rest over that of
scikit-fem's quadratic elements on the finest mesh, less 1.  Costs: processor time of one thread,
the median of three, of the critical step and the march (of the grain: 1 ms), without compiling.

Bars, set before the run: in bending a tenth of the error on the same mesh, and the coarsest
quadratic mesh better than the finest linear one at a hundredth of its cost; of the grain half of
the error on its own mesh.  A pulse has none: short waves were known to want linear ones.

Answer: docs/qdem-elements.md.
"""

ROOMS = "qdem_fem: bodies element kernel march"
