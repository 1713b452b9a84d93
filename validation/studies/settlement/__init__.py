"""How far does the loaded body sink in many load cycles, with what error, at what cost?

**Question.** The settlement of the loaded body (a sleeper's, a piston's) over cycles k_i to N, and
the stiffness on which it then stands, can be computed cycle by cycle, with jumps, or by what one
would do without jumps: a longer time step, softer grains, a faster load, a law fitted to the first
cycles.  Which of these errs by how much, and what does it cost?

**Answer.** docs/settlement.md.

**Design**, written down before the runs.  A bed of hard grains is chaotic and beds differ, so the
*packing*, the rain of one seed and its first k_i = 50 cycles, is the sample.  From its state one
full run goes on and one run of each way.  A way's error is its gain less the full run's of the same
packing, over the mean gain of all full runs; so both runs' chaos is in it.  Gains are of the loaded
body, from the mean of the ten cycle ends up to k_i to that of the ten up to N; the mean grain's
comes second.  Cost is all CPU time behind k_i.

| bed | packings (seeds) | N |
|---|---|---|
| confined: the paper's, 1,085 grains | 9 (1 to 9) | 500 |
| coarse: 150 grains, E = 1 GPa | 100 (101 to 200) | 500 |
| far: the same | 30 (101 to 130) | 10,000 |
| partial: a piston on 80 % of the section | 9 (1 to 9) | 100 |
| unseen: a box, another grading, E = 3 GPa, 25 Hz | 12 (1 to 12) | 500 |

Ways were chosen on confined packings 1 to 3 and coarse ones below 100, none on *unseen*; confined 1
to 3 are therefore no independent test.  A bound on bursts was added after confined packing 2; runs
in which it binds were computed again.  No other run is repeated because of what it gave.

*growing, k = 30* was added, before its first run, once growing had erred by +23 % on the unseen
bed: windows behind its jumps sink by a sixth of the whole gain more than full runs do there.  If
that is why its forecasts ask too much, windows three times as long halve the error, at half of the
gain in cost.  It runs on all unseen packings and on coarse ones 101 to 136; no margin is its own.

**Margins.**  Two one-sided tests at 5 %: the 90 % interval of the mean error lies within +-10 % on
the confined bed at five times less cost (equal cost a step), within +-10 % at ten times less with
twice the step, within +-5 % on the coarse, +-15 % on the unseen, +-10 % on the far bed at thirty
times less; the mean stiffness within 5 %.

Restart files and states are not kept in the record: ``python -m validation.study settlement run
--only "confined-1, every cycle"`` computes a run again from its rain, in the folder that
TRACKBED_VALIDATION names; a run that was killed goes on there.
"""

ROOMS = (
    "adapters: jumps moves procedure.forecast procedure.stages relaxation; tests: golden.digests"
)
