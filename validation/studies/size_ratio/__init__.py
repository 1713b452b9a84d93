"""Up to which ratio of grain sizes does static friction hold up in our engines?

Velocity Verlet gives friction's spring a velocity of the half step and a normal of the full one.
Vyas et al. (2025, doi 10.1016/j.cpc.2025.109524) found that a small grain then sticks between two
large ones where it should roll off, from a size ratio of about three on.

**Design**, their test of three grains under our decks: two held grains of 5 mm touch; a small one,
at rest in the groove between them and 1 degree off the top, rolls down.  Without slip it follows
an equation of its own (`run.roll`), leaves the groove where its normal force vanishes and falls.
What a run says: how far the roll is off at 35 degrees, and whether the grain falls within twice
the time that it takes to fall freely.

**Why it sticks, and where it cannot.**  In the groove a contact makes an angle theta with the axis
of the large grains, cos theta = R / (R + r).  A grain that is pressed into the groove is held by
friction alone only if tan theta < mu, that is for R / r > 1 / (sqrt(1 + mu^2) - 1) (`wedge_ratio`):
2.4 at mu = 1, 8.5 at mu = .5.  Below that ratio no error of a spring can hold it.

**Bars**, before the runs: below the wedge ratio every engine lets the grain fall at the step of our
scenes (.2 of the Rayleigh time); its roll is right to 1 %.

**Answer.** docs/size-ratio.md.
"""

ROOMS = "adapters: bed.contact_law engines.process; tests: golden.digests"
