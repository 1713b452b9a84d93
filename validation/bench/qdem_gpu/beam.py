"""The beam that kernels are raced on, on the processor and on a GPU."""

SIZE = (2.4, 0.25, 0.22)
"""[m]"""
MATERIAL = (45e9, 0.167, 2350.0)
"""E [Pa], nu, rho [kg/m^3] of the paper's concrete."""
FORCE = (100.0, 50.0, -1000.0)
"""Total force on the tip [N]; three components, so that no displacement stays zero."""
