"""Hard cases of rigid grains: does a scene rest, slide, fall or bounce exactly when it must?

Question: scenes whose answers are known in closed form or by a linear programme, either side of
their thresholds, at extreme mass ratios, slenderness and length of run: how far is each engine off?
Answer: ours meets every bar, to round-off where double precision allows it; MuJoCo is cheaper by
the step and off by its model's softness and tolerances.

Design, fixed before the runs: every engine is built from one description of the scene, starts from
the same state, takes steps of 1 ms unless said, and is judged by the same number against one bar.
"""

ROOMS = (
    "rigid_lcp: collision contact friction.attempts friction.auto friction.linear friction.methods "
    "friction.pivots friction.problem friction.sweeps motion shapes"
)
