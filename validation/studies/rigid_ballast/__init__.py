"""Ballast under a sleeper: rigid grains against soft ones, settlement against cost.

Question: Schwager and Poeschel (2002, section 10) expect that rigid grains may take steps of 1e-3 s
where Molecular Dynamics needs 1e-7 s, and that both cost the same in the end for ballast.  Do they,
at equal error of the residual settlement after five load cycles?
Answer: rigid steps of 1 ms cost what soft grains of 1e9 N/m do, with 500 times fewer steps; but the
two limits differ by half of their mean, so that smaller errors cannot be distinguished from noise.

Design, fixed before the runs: the 30 beds of ``ballast-2d.toml`` of seeds 1 to 30, none left
out, poured and tamped once by rigid grains; every method starts from that state at rest, has 50 ms
under the least load and five cycles.  Reference of a level: the mean of the finest level of each
method, bed by bed; a finest level is judged by the other.  Error: mean over the beds of the
difference to the reference over the reference's mean, with Student's interval of paired beds.
"""

ROOMS = (
    "rigid_lcp: collision contact friction.attempts friction.auto friction.linear friction.methods "
    "friction.pivots friction.problem friction.sweeps motion shapes"
)
