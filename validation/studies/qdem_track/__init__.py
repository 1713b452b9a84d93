"""What does a bogie do to ballast of deformable grains, and what does that cost?

After Nishiura, Sakaguchi and Aikawa 2017, section 4.  Two sizes: 20 grains under one blow, where
the balance of energies, resumption and ways to save cost are judged (``twenty``); 300 grains under
one bogie on a rough rail, packings 1 to 3 at the friction of Table 1, then at three times it, one
part a run (``packing 1 at 0.577`` and so on), beside what the paper found.

Bars, fixed before: the account of energies closes to .1 %, a resumed run equals the uninterrupted
one to the bit, a higher friction leaves less settlement and lateral motion; a bed is run in until a
slow pulse leaves .2 of the sleeper's way, and then bears the bogie: the sleeper is down at most
twice its way under the slow pulse of the same force.

Answer: docs/qdem-track.md.
"""

ROOMS = "qdem_fem: bodies contact element kernel march track"
