"""The race of friction solvers: what does a residual cost, and where does ours not get there?

Question: on real, generated and unseen problems of rigid contact with Coulomb's friction, which
solver reaches which residual in what processor time?
Answer: ours reaches 1e-12 on all but a few of the raced problems, mostly as the fastest; near the
friction at which a packing yields one convex program and plain Newton steps are faster.

Design, fixed before the runs: one judge for all (`rigid_lcp`'s scale-free natural residual, twice
in extended precision for unseen problems: `validation.bench.rigid.judge`); every solver starts from
zero, is asked for the same tolerances, keeps its other settings and is timed in processor seconds
of one thread.  Rivals: Siconos, Clarabel with ``|u_T|`` frozen, Clarabel and then semismooth
Newton, OSQP where there is no friction (`peers`).  Unseen problems follow from a seed that no
setting was chosen by (`validation.bench.rigid.examination`).
"""

ROOMS = (
    "rigid_lcp: friction.attempts friction.auto friction.linear friction.methods "
    "friction.pivots friction.problem friction.sweeps sparse"
)
