"""Does a line of beds become uneven as lines do, on what does it hang, and what does it cost?

**Question.** Which rate of D1 comes out for the beds that a scene may have, beside what was
published of lines; which of our assumptions decides it; and how does its error go with cost?

**Answer.** docs/track-geometry.md.

**Design.**  The scene that is shipped (1 km, axles of 20 t, law of Shenton, 30 lines, 100 MGT) and
single changes of it: rate of the median section from 20 MGT on.  Published: rates of maintenance
models, that sleeper pads halve the rate (Graz 2022), that faults come back where the ground is soft
and its stiffness changes along the line (Nielsen et al. 2020), a test of the open program ROSE.
Cost: blocks, wheels of the comb, lines; against a run with four times the blocks, wheels 40 seats
apart, groups of lines.  The bars are what was published; our first rates were known when they were
written down.  Grading: ``bed.toml`` by growing jumps to 500 cycles with EN 13450 31.5/50 and with
AREMA 4, seeds 1 to 12, by threes in turn, none left out; the law that fits best; a line each; the
ratio of their D1 with its interval of 90 % by leaving out packings.  No bar.  Written down before
these runs.  A first design, softer stones with rolling resistance in a box of 0.18 m by 0.14 m, was
left after six beds of EN and one of AREMA: they settled by 0.5 to 31 mm, of which twelve have no
mean.
"""

ROOMS = "track_line: beam laws measured settling beds"
