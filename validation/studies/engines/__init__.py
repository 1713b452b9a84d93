"""Do three engines settle one packing by the same amount, and how fast is each?

**Question.** How far do settlement, coordination number and density depend on the engine, and on
what in it?  What does a step cost on LIGGGHTS, LAMMPS and YADE?

**Answer.** docs/engines.md.

**Design of the packings**, fixed before any result was looked at:

* beds: the coarse scene (1 GPa), seeds 1 to 8; the rain of grains is LIGGGHTS';
* start: every way gets the rained positions and radii, grains at rest, no contact history; it lets
  them rest under gravity, seats the piston as in any run of a scene, and computes 50 load cycles;
* figures come from positions and the piston's record alone, by the same code for every way;
* differences of two ways are taken bed by bed, mean and Student's interval over the beds.  One is
  called real when the interval at 0.05/9 excludes zero: three pairs of engines times three
  figures (settlement, coordination number, relative density);
* noise: LIGGGHTS against itself with one grain 1e-9 m aside: no two engines can be distinguished by
  less than what this twin strays.  No run is added, dropped or run again because of what it gave;
* twice the time step (``fast``): settlement, stiffness under the piston and the energy that a cycle
  loses, on all eight beds and each engine beside the usual step.

**Design of the speeds.** 1,111 grains of the paper's Table 1 settle in a box whose sides are rigid
frictionless mirrors; 9,999 are 3 x 3 such tiles, every other one reflected, so that the larger bed
is in balance as it is.  Every engine starts from the same places under its own law with the same
step; the cost of a step is the difference of two runs of different length, so that start-up does
not count; a run is refused unless all grains are left, finite and at rest at its end.
"""

ROOMS = "adapters: bed.overlaps engines.process files.window; tests: golden.digests"
