"""Which model of contact between deformable bodies gives the right stress, and at what cost?

Two models: spheres at the vertices of the surface (the paper's), and points on the faces.
They are asked four things: the stress between two cubes that are pressed on
each other, on meshes that match and that do not (exact: uniform); Hertz's force and radius on
three meshes, beside linear tetrahedra of scikit-fem with an active set; the account of energies
in six hard cases (deep start, stiffness 1 : 1000, meshes 1 : 100, a spinning grain, a stack, a
load that goes); and the share of contact in a step of 216 grains of the paper's size.  Bars,
fixed before: force carried to .1 %, stress to 1 % where a model is exact, energies to .1 % of
the greatest, contact at most 30 % of a step with spheres.

Answer: docs/qdem-contact.md.
"""

ROOMS = "qdem_fem: bodies contact element kernel march"
