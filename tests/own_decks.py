"""Small decks as users write them, of spheres in a box under a heavier and a lighter gravity."""

LIGGGHTS = """\
# a bed of my own, from before trackbed
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region reg block -0.001 0.061 -0.001 0.061 -0.001 0.15 units box
create_box 1 reg
neighbor 0.002 bin
neigh_modify delay 0
variable young index 5.e6
fix m1 all property/global youngsModulus peratomtype ${young}
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.3
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 0.00002
include walls.in
region fill block 0.001 0.059 0.001 0.059 0.001 0.12 units box
fix pts1 all particletemplate/sphere 15485863 atom_type 1 density constant 2500 &
    radius constant 0.005
fix pdd1 all particledistribution/discrete 32452843 1 pts1 1.0
fix ins all insert/pack seed 32452867 distributiontemplate pdd1 maxattempt 200 insert_every once &
    overlapcheck yes all_in yes vel constant 0. 0. -0.3 region fill particles_in_region 80
fix integr all nve/sphere
fix grav all gravity 9.81 vector 0 0 -1
dump pictures all custom 5000 post/bed_*.txt id x y z # comment
run 1
unfix ins
run 9000
# trackbed: cycle
unfix grav
fix grav all gravity 30 vector 0 0 -1
run 400
unfix grav
fix grav all gravity 9.81 vector 0 0 -1
run 400
# trackbed: end
"""
WALLS = """\
fix x1 all wall/gran model hertz tangential history primitive type 1 xplane 0.0
fix x2 all wall/gran model hertz tangential history primitive type 1 xplane 0.06
fix y1 all wall/gran model hertz tangential history primitive type 1 yplane 0.0
fix y2 all wall/gran model hertz tangential history primitive type 1 yplane 0.06
fix z1 all wall/gran model hertz tangential history primitive type 1 zplane 0.0
"""
PLATE = """\
fix plate all mesh/surface/stress file plate.stl type 1
fix hold all wall/gran model hertz tangential history mesh n_meshes 1 meshes plate
"""
"""A plate on top of the bed, for `LIGGGHTS`: a mesh at the height of `PLATE_STL`."""
CORNERS = ("0.001 0.001", "0.059 0.001", "0.059 0.059", "0.001 0.059")
FACET = "facet normal 0 0 -1\nouter loop\n{}endloop\nendfacet\n"
PLATE_STL = "".join(
    FACET.format("".join(f"vertex {CORNERS[k]} 0.045\n" for k in facet))
    for facet in ((0, 1, 2), (0, 2, 3))
)
PLATE_STL = f"solid plate\n{PLATE_STL}endsolid plate\n"
PRESSED = """\
# trackbed: cycle
fix press all move/mesh mesh plate linear 0. 0. -0.02
run 400
unfix press
fix press all move/mesh mesh plate linear 0. 0. 0.02
run 400
unfix press
# trackbed: end
"""
"""A cycle of the plate: down and up by 0.16 mm."""
LAMMPS = """\
units si
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
region box block -0.001 0.061 -0.001 0.061 -0.001 0.15 units box
create_box 1 box
neighbor 0.002 bin
neigh_modify delay 0
pair_style gran/hertz/history 5e6 NULL 5e6 NULL 0.5 0
pair_coeff * *
timestep 0.00002
region bed block 0 0.06 0 0.06 0 0.2 units box
region fill block 0.006 0.054 0.006 0.054 0.006 0.12 units box
create_atoms 1 random 60 12345 fill overlap 0.01 maxtry 1000
set type 1 diameter 0.01 density 2500
fix integr all nve/sphere
fix grav all gravity 9.81 vector 0 0 -1
fix walls all wall/gran/region hertz/history 5e6 NULL 5e6 NULL 0.5 0 region bed
run 9000
# trackbed: cycle
fix grav all gravity 30 vector 0 0 -1
run 400
fix grav all gravity 9.81 vector 0 0 -1
run 400
# trackbed: end
"""
STONES = (
    LIGGGHTS.replace(
        "fix pts1 all particletemplate/sphere 15485863 atom_type 1 density constant 2500 &\n"
        "    radius constant 0.005",
        "fix pts1 all particletemplate/multisphere 15485863 atom_type 1 density constant 2500 &\n"
        "    nspheres 2 ntry 100000 spheres 0 0 0 0.005 0.004 0 0 0.004 type 1",
    )
    .replace("particles_in_region 80", "particles_in_region 40")
    .replace("fix integr all nve/sphere", "fix integr all multisphere")
    .replace("atom_modify map array", "atom_modify map array sort 0 0")
)
"""`LIGGGHTS` with stones of two overlapping spheres."""
YADE = """\
# a bed of my own, from before trackbed
from yade import plot, qt
import helpers
qt.View()
readParamsFromTable(weight=30.0)
from yade.params.table import *
O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500, frictionAngle=0.5))
O.bodies.append(geom.facetBox((0.03, 0.03, 0.1), (0.03, 0.03, 0.1), wallMask=31))
for k in range(40):
    x, y, z = 0.01 + k % 3 * 0.018, 0.01 + k // 3 % 3 * 0.018, 0.01 + k // 9 * 0.018
    if k % 2:
        O.bodies.append(sphere((x, y, z), 0.005 + 1e-4 * (k % 7)))
    else:
        O.bodies.appendClumped([sphere((x + s * 0.003, y, z), 0.005) for s in (0, 1)])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(damping=0.3, gravity=(0, 0, -9.81), label="newton"),
    PyRunner(command="count()", iterPeriod=100),
]
O.dt = 2e-5
seen, plate = {"calls": 0, "cycles": 0}, None

def count():
    seen["calls"] += 1
    plot.addData(i=O.iter)

O.run(20000)
O.wait()
unbalancedForce = seen["calls"]  # a function of YADE has this name
top = max(b.state.pos[2] + b.shape.radius for b in O.bodies if isinstance(b.shape, Sphere))
plate = O.bodies[O.bodies.append(wall(top, axis=2, sense=-1))]
# trackbed: cycle
newton.gravity = helpers.pull(weight)
plate.state.vel = (0, 0, -0.02)
O.run(400, True)
newton.gravity = helpers.pull(9.81)
plate.state.vel = (0, 0, 0.02)
O.run(400, True)
seen["cycles"] += 1
assert seen["calls"] == len(plot.data["i"]) == unbalancedForce + 8 * seen["cycles"]
# trackbed: end
"""
"""Spheres and clumps under a plate; functions, variables, a body, an engine and what is plotted
are used in the cycle."""
HELPERS = "def pull(g):\n    return 0, 0, -g\n"
FRAGMENTS = """\
run 400
variable now equal step
variable left equal x[7]-0.0025
variable right equal x[7]+0.0025
variable y equal y[7]
variable z equal z[7]
variable wide equal 0.01*(1-0.001*floor((step-{start})/800))
if "${{now}} == {step}" then &
  "create_atoms 1 single ${{left}} ${{y}} ${{z}} units box" &
  "create_atoms 1 single ${{right}} ${{y}} ${{z}} units box" &
  "set atom {new} diameter 0.005 density 2500" &
  "group broken id 7" "delete_atoms group broken compress no"
set atom 5 diameter ${{wide}} density 2500
"""


def break_grains(engine: str, cycle: int) -> str:
    """A deck in which two fragments of half its diameter take the place of grain 7 in a ``cycle``;
    grain 5 loses a thousandth of its first diameter in each."""
    text, start, grains = (LAMMPS, 9000, 60) if engine == "lammps" else (LIGGGHTS, 9001, 80)
    text = text.replace("atom_style sphere\n", "atom_style sphere\natom_modify map array\n")
    new, step = f"{grains + 1}*{grains + 2}", start + 800 * (cycle - 1) + 400
    return text.replace("run 400\n", FRAGMENTS.format(start=start, new=new, step=step), 1)
