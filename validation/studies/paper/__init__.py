"""Do one jump's error and the relaxed cell of Karrech et al. (2007), Figs 6 to 8, come out here?

**Question.** Does E_r (eq. 22) of one jump by the linear and the log law fall with more cycles
before (k_i) and in the window (k) and rise with the jump (h), as the paper has it, and by more than
moving nothing does?  Does the relaxation bring a cell of nine grains to equilibrium?

**Answer.** docs/paper.md.

**Design.** The stored full run of the paper's bed (1,085 grains, 46.9 GPa, 50 Hz, 300 cycles), all
windows with k_i of 10 to 200, k and h of 5 to 80 that it has.  Eq. 22 has coordinates
in its text and displacements in its symbols, so there are three denominators.  Two rivals: nothing
moved, and what a run that began 1e-10 m apart moved.  The cell: the paper gives no measures; eight
equal grains at the corners of a cube around one that the estimate moves 1.8 mm into a corner.  The
runs are read from TRACKBED_DATA: ``TRACKBED_DATA=FOLDER python -m validation.study paper run``.
"""

ROOMS = "adapters: bed laws relaxation"
