"""Which element for a body's mesh, and at what cost?

Linear and quadratic tetrahedra on three meshes of three bodies: the paper's cantilever as it bends,
the same bar as a pulse runs along it (`validation.studies.qdem_cost`, beside spectral elements),
and a grain squeezed between two of its faces (its force at rest, beside quadratic elements on the
finest mesh, which tests compare with scikit-fem's).  Costs: processor time of one thread, the
median of three, of the critical step and the march; of the grain, of 1 ms.

Bars, set before the run: quadratic elements leave a tenth of the error in bending on the same mesh,
half of it in the grain, and the coarsest bend better than the finest linear ones at a hundredth of
the cost.  A pulse has none: short waves were known to want linear ones.
Answer: docs/qdem-elements.md.
"""

ROOMS = "qdem_fem: bodies element kernel march"
