"""Which way to many load cycles, with what error, at what cost?

**Question.** A bed's settlement after 500 cycles can be computed cycle by cycle, or with jumps, or
by what one would do without jumps: softer or heavier grains, a longer time step, a faster load, a
law fitted to the first cycles.  Which of these errs by how much, and what does it cost?

**Answer.** docs/settlement.md.

**Design.** Two beds: the paper's (`karrech`, 1,085 grains, E = 46.9 GPa, confined, 50 Hz) and a
coarse, softer one (`karrech-coarse`, 150 grains, 1 GPa).  A bed of hard grains is chaotic: one
grain moved by 1e-10 m changes the settlement after 60 cycles by several per cent.  So the reference
is an ensemble: a *packing* is the rain of grains of one seed and its first k_i cycles, a *member*
goes on from that state with one grain moved by m times 1e-10 m (member 0: by none).  Every other
way starts from the state of the same packing after k_i cycles and goes to the same last cycle; it
is judged by its mean over packings less that of the full runs, beside Student's interval over the
packings and beside what chaos alone makes.  Cost is all CPU time behind k_i: engine, starts,
relaxations, failed tries.  No way is run again because of what it gave.

The record holds of every full run a table thinned to some 60 rows, evenly spaced in ln N.  Restart
files and states are not kept: ``python -m validation.study settlement run --only "confined-1-0,
every cycle"`` computes a run again from its rain (two CPU hours; a coarse one 25 minutes), in the
folder that TRACKBED_VALIDATION names; a run that was killed goes on there.
"""

ROOMS = "adapters: bed engines jumps laws moves procedure relaxation"
