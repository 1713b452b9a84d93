"""What does an explicit method with linear tetrahedra do where meshes and materials are unkind?

A sliver, Poisson's ratios near one half, steps close to the critical one.  The judge is scikit-fem
on the same mesh: static field to 1e-5, critical step to .2 % and never above, motion over two
periods to 2e-3, energy within its closed bound.  Small forms of all, jumps of stiffness, elements
turned over, separate parts, loose nodes and left-handed elements are tests
(`tests/verification/test_qdem_hard_cases.py`).

Answer: docs/qdem-hard-cases.md.
"""

ROOMS = "qdem_fem: bodies element kernel march"
