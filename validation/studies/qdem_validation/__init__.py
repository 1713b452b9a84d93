"""Does QDEM give the answers of linear tetrahedra, and how far are those from the truth?

The judge (`validation.bench.qdem.judge`) is scikit-fem on the same mesh, solved to the last
digits: static tip and stress, eigenvalues of (K, lumped M), the sum over all modes in time.  What
QDEM and its judge share, the error of the mesh, is measured against quadratic tetrahedra and
closed forms. The body is the concrete cantilever of Nishiura et al. 2017, section 3.1, up to the
paper's number of elements.  Bars, fixed before: tip 1e-5, von Mises stress .04 % in the mean and
.12 % at most (the paper's own), frequencies .1 %, orders of convergence 2 within .1 to .2.  What
is conserved (energy, momentum, creep by closed forms) is in
`tests/verification/test_qdem_conservation.py`.

Answer: docs/qdem-validation.md.
"""

ROOMS = "qdem_fem: bodies element kernel march"
