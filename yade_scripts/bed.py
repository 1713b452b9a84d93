"""Bodies, walls, contact law and engines of a bed of grains, from the one JSON file of a run.

Grains are bodies 0 ... n-1; walls follow in the order of ``walls``, the piston comes last.
Standard library and YADE only.
"""

import json
import sys
from math import atan, pi

from yade import Omega, Vector3, wrapper
from yade.utils import facet, sphere, wall

O = Omega()
GRAIN_MASK, WALL_MASK, BALLAST_MASK = 1, 3, 4
"""Group masks: bodies meet when they share a bit; walls, of bit 2, never meet one another."""
PLANE, RIM = 8, 16
"""Bits of grains under a piston over a part of the bed: each meets its plane, or its rim."""
ROLLING_STEPS = 2
"""Time steps in which a new contact with a wall has YADE's own slider, which never slips: too few
for its spring to brake what rolls."""
NO_ROLLING = 1e-12
"""Coefficient of a slider that resists nothing [-]: YADE takes 0 for one that never slips."""
STILL = 1e-100
"""Share of the time step with which forces are worked out anew: no spring stretches, and
velocities, which the law divides by the step, keep their digits."""


def read_parameters():
    """The JSON file named on the command line, else the one that the engine writes."""
    with open([*sys.argv, "params.json"][1], encoding="utf-8") as stream:
        return json.load(stream)


def add_materials(parameters):
    """Materials by name: grain, wall, and mirror where the scene has one."""
    for name, properties in parameters["materials"].items():
        O.materials.append(wrapper.FrictMat(label=name, **properties))


def add_grains(parameters):
    """Grains at rest at the places and with the radii of the parameters [m]."""
    grains = parameters["grains"]
    for position, radius in zip(grains["position"], grains["radius"]):
        O.bodies.append(sphere(position, radius, material="grain", mask=GRAIN_MASK))


def add_walls(parameters):
    """Planes along the axes, and one triangle for each side of a cylinder."""
    for w in parameters["walls"]:
        kind = {"material": w["material"], "mask": WALL_MASK}
        if "vertices" in w:
            body = facet([Vector3(*v) for v in w["vertices"]], **kind)
        else:
            body = wall(w["position"], w["axis"], w["sense"], **kind)
        O.bodies.append(body)


class Piston:
    """A flat face with a mass: a clump, driven by forces along z.

    Over the whole section the face is one triangle.  Over a part of it, it is a plane for the
    grains within ``plane_reach`` of the axis, or within ``plane_edges``, and a fan of triangles for
    those further out, which ends where the piston does: a grain meets one of the two
    (`grains_share`), and is pushed twice on a seam of two triangles only near the rim.

    Its members have no mass of their own, so that a contact damps with the mass of its grain.
    YADE makes no clump without a sphere; that sphere touches nothing, and at the face's height
    gives the clump this height.
    """

    def __init__(self, parameters):
        """Find the piston among the bodies, or make it where there is none yet."""
        piston = parameters["piston"]
        self.mass = piston["mass"]
        self.plane_reach = piston.get("plane_reach")
        self.plane_edges = piston.get("plane_edges")
        self.parted = self.plane_reach is not None or self.plane_edges is not None
        self.grains = parameters["grain_count"]
        first = self.grains + len(parameters["walls"])
        members = len(piston["triangles"]) + self.parted
        self.faces = list(range(first, first + members))
        self.ballast = self.faces[-1] + 1
        self.clump = self.ballast + 1
        if len(O.bodies) == first:
            self._make(piston)
        assert len(O.bodies) == self.clump + 1, "the saved bed has another piston"
        self.grains_share()

    def _make(self, piston):
        z, of_walls = piston["height"], WALL_MASK & ~GRAIN_MASK
        mask = RIM | of_walls if self.parted else WALL_MASK
        members = [
            facet([Vector3(x, y, z) for x, y in triangle], material="wall", mask=mask)
            for triangle in piston["triangles"]
        ]
        if self.parted:
            members.append(wall((0, 0, z), 2, -1, material="wall", mask=PLANE | of_walls))
        members.append(sphere((0, 0, z), 1e-3, material="wall", mask=BALLAST_MASK))
        made = O.bodies.appendClumped(members)
        assert made == (self.clump, [*self.faces, self.ballast]), made
        state = O.bodies[self.clump].state
        state.mass, state.inertia = self.mass, Vector3(1, 1, 1)
        state.blockedDOFs = "xyXYZ"

    def grains_share(self):
        """Have each grain meet the plane or the rim; True where one changed from one to the other.

        Then engines are to be set anew: a collider looks at pairs whose bounds began to overlap.
        The contact it had is made anew by the other face, without its tangential spring.
        """
        if not self.parted:
            return False
        changed = False
        for number in range(self.grains):
            body = O.bodies[number]
            place = body.state.pos
            inside = self.covers(place[0], place[1])
            mask = GRAIN_MASK | (PLANE if inside else RIM)
            if body.mask != mask:
                body.mask = mask
                changed = True
                for face in self.faces:
                    if O.interactions.has(number, face):
                        O.interactions.erase(number, face)
        if changed:  # erased ones only sleep while bounds overlap, whatever the masks say
            O.interactions.eraseNonReal()
        return changed

    def covers(self, x, y):
        """Whether a grain there [m] meets the plane, not the rim."""
        if self.plane_edges is None:
            return x**2 + y**2 < self.plane_reach**2
        left, right, front, back = self.plane_edges
        return left < x < right and front < y < back

    @property
    def height(self):
        """Height of the face [m]."""
        return O.bodies[self.clump].state.pos[2]

    @property
    def speed(self):
        """Velocity along z [m/s]."""
        return O.bodies[self.clump].state.vel[2]

    def place(self, height):
        """Put the face, at rest, at a height [m]; the members too, which follow a step later."""
        shift = Vector3(0, 0, height - self.height)
        for number in (*self.faces, self.ballast, self.clump):
            state = O.bodies[number].state
            state.pos, state.vel = state.pos + shift, Vector3.Zero

    def press(self, force, gravity):
        """Constant force on the bed [N]; gravity [m/s^2] does not act on the piston.

        YADE does not save it: it is told again after each load.
        """
        O.forces.setPermF(self.clump, Vector3(0, 0, self.mass * gravity - force))

    def contact_force(self):
        """Force of the bed on the face [N], upwards."""
        return sum(O.forces.f(number, True)[2] for number in self.faces)

    def target_force(self, gravity):
        """Force that presses the piston on the bed in this step [N], without its contacts."""
        return self.mass * gravity - O.forces.f(self.clump, True)[2]


def make_contact_law(parameters):
    """Hertz-Mindlin contacts; damping and friction are those of the pair of materials.

    ``rolling``, where the scene names it, is resisted by a spring and a slider: between grains by
    eta (R_1 + R_2)/2 F_n at most, which is mu_r R* F_n of two alike and an eighth more at 1 to 2.
    """
    rolling = parameters.get("rolling")

    def of_pairs(key, value=float):
        matches = [
            (O.materials[p["first"]].id, O.materials[p["second"]].id, value(p[key]))
            for p in parameters["pairs"]
        ]
        return wrapper.MatchMaker(matches=matches, algo="zero")

    physics = wrapper.Ip2_FrictMat_FrictMat_MindlinPhys(
        betan=of_pairs("damping_normal"),
        betas=of_pairs("damping_tangential"),
        frictAngle=of_pairs("friction", atan),
    )
    if rolling and rolling["grain"]:
        physics.eta = rolling["grain"] / 2
        physics.krot = rolling["spring"] * (rolling["radius"] / 2) ** 2
    # hertzian: a wall is flat; by itself YADE takes it for a sphere like the one that touches it.
    shapes = [
        wrapper.Ig2_Sphere_Sphere_ScGeom(),
        wrapper.Ig2_Wall_Sphere_ScGeom(hertzian=True),
        wrapper.Ig2_Facet_Sphere_ScGeom(hertzian=True),
    ]
    law = wrapper.Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=bool(rolling))
    return wrapper.InteractionLoop(shapes, [physics], [law])


def limit_rolling(parameters):
    """Spring and slider of rolling at walls: R* = R; YADE takes a wall for a sphere of 1,000 km.

    No slider at all is none that slips: where nothing resists, the slider is next to nothing.
    """
    rolling = parameters["rolling"]
    for wall_number in range(parameters["grain_count"], len(O.bodies)):
        for contact in O.bodies[wall_number].intrs():
            grain = O.bodies[min(contact.id1, contact.id2)]
            radius, name = grain.shape.radius, O.bodies[wall_number].material.label
            contact.phys.kr = rolling["spring"] * radius**2
            contact.phys.maxBendPl = max(rolling[name], NO_ROLLING) * radius


def set_engines(parameters, forces=(), watch=(), behind=()):
    """The engines of a step: neighbours, contacts, ``forces``, ``watch``, motion, ``behind``."""
    collider = wrapper.InsertionSortCollider(
        [wrapper.Bo1_Sphere_Aabb(), wrapper.Bo1_Wall_Aabb(), wrapper.Bo1_Facet_Aabb()],
        verletDist=parameters["verlet_distance"],
        avoidSelfInteractionMask=WALL_MASK & ~GRAIN_MASK,
    )
    motion = wrapper.NewtonIntegrator(
        damping=0, gravity=(0, 0, -parameters["gravity"]), kinSplit=True
    )
    rolling = wrapper.PyRunner(command="bed.limit_rolling(parameters)", iterPeriod=ROLLING_STEPS)
    O.engines = [
        wrapper.ForceResetter(),
        collider,
        make_contact_law(parameters),
        *[rolling] * ("rolling" in parameters),
        *forces,
        *watch,
        motion,
        *behind,
    ]
    O.dt = parameters["time_step"]


def renew_forces(forces=()):
    """Work out contacts and forces at the present positions, without a step in time.

    YADE keeps those of the positions a step before, and after a load none at all; it does not
    notice positions set by hand unless its collider is called.
    """
    time_step = O.dt
    O.dt = STILL * time_step
    for engine in (*O.engines[:3], *forces):
        engine()
    O.forces.f(0, True)  # sum up: what is not summed up outside a step is added to the next one
    O.dt = time_step


def make_load_engine(load, piston):
    """What the load adds to its mean force, in C++; cycles start at multiples of the period, or
    now: a stage of another frequency began at no multiple of its own."""
    if load["waveform"] == "sine":
        phase = -2 * pi * load["frequency"] * O.time if load.get("begins_now") else 0.0
        return wrapper.HarmonicForceEngine(
            ids=[piston.clump],
            A=(0, 0, load["amplitude"] / 2),
            f=(0, 0, load["frequency"]),
            fi=(0, 0, pi / 2 + phase),
        )
    return wrapper.InterpolatingDirectedForceEngine(
        ids=[piston.clump],
        times=load["time"],
        magnitudes=load["force"],
        direction=(0, 0, -1),
        wrap=True,
    )


def make_drag_engine(piston, coefficient):
    """Viscous drag on the piston: ``coefficient`` [N s/m] times its speed.

    YADE's Stokes drag 6 pi nu r v needs a sphere: the piston's ballast.
    """
    radius = O.bodies[piston.ballast].shape.radius
    return wrapper.LinearDragEngine(ids=[piston.ballast], nu=coefficient / (6 * pi * radius))
