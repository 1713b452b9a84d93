"""Do the engines compute the contact law that a scene asks for?

**Question.** How far are force, duration, rebound, friction impulse and spin of single impacts on
LIGGGHTS, LAMMPS and YADE from closed forms, and from each engine's own law computed by other code?

**Answer.** docs/contact-law.md.

**Design.** The eight single impacts of Chung and Ooi (2011), two materials each, on every engine
with the input that a bed gets (`Engine.write_preparation`), 1,000 steps in a contact.  Bars, set
before: tests 1 to 3 within 1 % of Hertz and of the restitution asked for; the sliding limits of
tests 4 to 8 within 2 % of rigid bodies'; all impulses within 2 % of the engine's law integrated by
other code with a step twenty times shorter; momentum 1e-12; least orders of convergence in the
step.  The limits of rigid bodies hold for a law without pull and tangential damping, so they are
asked under that law; under the scene's law the excess is reported, with its cause.

Driven contacts, closed loops and mirror planes are tested in
``tests/engines/test_contact_law_engine.py``.
"""

ROOMS = "adapters: bed.contact_law engines.process; tests: golden.digests"
