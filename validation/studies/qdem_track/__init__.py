"""What does a bogie do to ballast of deformable grains, and what does that cost?

After Nishiura, Sakaguchi and Aikawa 2017, section 4.  Three sizes: 20 grains under one blow, where
the balance of energies, resumption and ways to save cost are judged (``twenty``); 300 grains under
one bogie on a rough rail, three packings at the friction of Table 1 and at three times it
(``packings``), beside what the paper found; and the paper's 5,700 grains at rest, where a step is
timed (``paper scale``: the bed is prepared before by `trackbed qdem track.toml`, in hours).
Bars, fixed before: the account of energies closes to .1 %, a resumed run equals the uninterrupted
one to the bit, a higher friction leaves less settlement and lateral motion.

Answer: docs/qdem-track.md.  **The record of ``packings`` is not what the code does today**: it is
from before grains were scattered at the start of their fall (measured at 6035ef5).
"""
