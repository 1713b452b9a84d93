"""Known up to N_c cycles, what is the settlement at 10 N_c, and how far is that wrong?

**Question.** Which law of settlement, alone or by the votes of `adapters.laws.fit.outlook`, errs
least ten times ahead, does its band hold the truth, and does it refuse what no slow law predicts?

**Answer.** docs/laws.md.

**Design.** Real ballast: 12 cyclic triaxial tests (Sun, Indraratna and Nimbalkar 2016, digitised),
cut in all ways; once more with their frequency, each by what the other eleven teach.  Made series:
12 members each of twelve families of the literature, half of them none of the laws, read off with
noise and digits as from a published curve, with a seed that no choice was made on; and five
families with a constant or growing rate, which are to be refused.  Full runs of an engine from
cycle 1.  Bars, set before: median error 8 %, 90th percentile 20 %, the 90 % band holds the truth in
85 %, the rms error on ballast is below that of nothing more settles, the hyperbolic law and the
logarithm; of the fast families 95 % refused, of the slow ones 10 % at most.  Real series are read
from TRACKBED_DATA: ``TRACKBED_DATA=FOLDER python -m validation.study laws run`` (some minutes).
"""

ROOMS = "adapters: laws"
