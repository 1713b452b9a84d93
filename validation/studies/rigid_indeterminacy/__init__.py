"""Statically indeterminate grains: are the forces of the rigid limit those of ever stiffer springs?

Question: rigid grains with more contact forces than equations of balance have many forces that
fit; are those of the direct limit (`rigid_lcp.unique.elastic_limit`) the ones molecular dynamics
tends to, does order matter, and what do they cost?
Answer: without friction, and where contacts stick, springs differ by 1/k until round-off; where
contacts slide, the forces depend on the history, and springs may rest in another state.

Design: every scene by the direct limit, by the relaxation of section 8, by springs integrated in
time by a program of its own (`springs`) and by LIGGGHTS where the grains are discs.  Error: the
greatest difference of a contact force from the direct limit over the weight of all grains.
"""

ROOMS = (
    "rigid_lcp: friction.attempts friction.auto friction.linear friction.methods "
    "friction.pivots friction.problem friction.sweeps unique"
)
