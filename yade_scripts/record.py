"""What a run leaves: states, contacts, the piston's record, the saved scene.

The columns are those of the LIGGGHTS decks: a reader need not know which engine wrote a file.
Standard library, numpy and YADE only.
"""

import gzip
import os
import signal

import numpy as np
from yade import Omega
from yade.wrapper import PyRunner

O = Omega()
SAVED = "end.yade.gz"
"""YADE knows the format of a saved scene by this ending; whole, it is renamed end.restart."""
STATE_COLUMNS = "id x y z vx vy vz omegax omegay omegaz radius mass"


def split_vector(vector):
    """The three numbers of a vector of YADE.

    By index: to unpack one, or to make an array of it, ends in an exception of C++, which costs
    more than all the rest.
    """
    return vector[0], vector[1], vector[2]


def tabulate_grains(count):
    """x, v, omega, radius, mass of the grains [SI], shape (count, 11)."""
    rows = []
    for number in range(count):
        body = O.bodies[number]
        s = body.state
        motion = split_vector(s.pos) + split_vector(s.vel) + split_vector(s.angVel)
        rows.append((*motion, body.shape.radius, s.mass))
    return np.array(rows)


def tabulate_contacts(grains):
    """Contacts between grains, a row each, and the force of every other body on the grains.

    ``grains`` as from `tabulate_grains`.  A row holds both numbers, from 1 on, then on the first
    grain the normal and the tangential force [N], the tangential spring [m], and the overlap [m];
    shape (m, 12).  The spring is the elastic part of the tangential force over the stiffness.
    The second result is a dictionary: number of a wall's body -> force [N], shape (count, 3).
    """
    count, position, radius = len(grains), grains[:, :3], grains[:, 9]
    rows, of_walls = [], []
    for contact in O.interactions:
        if not contact.isReal:
            continue
        first, second, physics = contact.id1, contact.id2, contact.phys
        force = split_vector(physics.normalForce) + split_vector(physics.shearForce)
        if first < count and second < count:
            elastic = split_vector(physics.shearElastic)
            rows.append((first, second, *force, *elastic, physics.ks))
        else:
            of_walls.append((first, second, *force))
    table = np.array(sorted(rows)).reshape(-1, 12)
    first, second = table[:, :2].astype(int).T
    apart = np.linalg.norm(position[first] - position[second], axis=1)
    table[:, :2] += 1
    table[:, 8:11] /= table[:, 11:]
    table[:, 2:8] *= -1
    table[:, 11] = radius[first] + radius[second] - apart
    return table, sum_wall_forces(of_walls, count)


def sum_wall_forces(rows, count):
    """Force of each wall on each grain [N] from rows of both numbers, normal and shear force."""
    forces = {}
    for first, second, *force in rows:
        grain, wall, sign = (first, second, 1) if first < count else (second, first, -1)
        if wall not in forces:
            forces[wall] = np.zeros((count, 3))
        forces[wall][grain] += [sign * -(force[i] + force[i + 3]) for i in range(3)]
    return forces


class Dumps:
    """``states.dump`` and ``contacts.dump``: one frame an instant, text, of full precision."""

    def __init__(self, parameters, piston=None):
        """Open both files; with a ``piston`` its force on the grains is the last wall's."""
        self.count = parameters["grain_count"]
        self.friction = parameters["frictional"]
        self.bounds = parameters["box"]
        names = [wall["name"] for wall in parameters["walls"]]
        self.bodies = [[self.count + index] for index in range(len(names))]
        if piston is not None:
            names.append("piston")
            self.bodies.append(piston.faces)
        forces = [f"f_force_{name}[{axis}]" for name in names for axis in (1, 2, 3)]
        self.columns = " ".join([STATE_COLUMNS, *forces])
        self.states = open("states.dump", "w", encoding="ascii")
        self.contacts = open("contacts.dump", "w", encoding="ascii")

    def frame(self):
        """Append the present state; call `bed.renew_forces` before it."""
        grains = tabulate_grains(self.count)
        rows, walls = tabulate_contacts(grains)
        still = np.zeros((self.count, 3))
        forces = [sum((walls.get(b, still) for b in bodies), still) for bodies in self.bodies]
        identifier = np.arange(1, self.count + 1)
        write_frame(
            self.states, "ATOMS", self.columns, np.column_stack([identifier, grains, *forces]),
            1, self.bounds,
        )  # fmt: skip
        if not self.friction:  # neither tangential force nor spring
            rows = rows[:, [0, 1, 2, 3, 4, 11]]
        names = " ".join(f"c_contact[{i + 1}]" for i in range(rows.shape[1]))
        write_frame(self.contacts, "ENTRIES", names, rows, 2, self.bounds)


def write_frame(stream, kind, columns, values, integers, bounds, number="%.17g"):
    """Append a frame to a text dump; the first ``integers`` columns are whole numbers."""
    stream.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF {kind}\n{len(values)}\n")
    stream.write("ITEM: BOX BOUNDS ff ff ff\n")
    stream.writelines(f"{low:.17g} {high:.17g}\n" for low, high in bounds)
    stream.write(f"ITEM: {kind} {columns}\n")
    row = " ".join(["%d"] * integers + [number] * (len(columns.split()) - integers)) + "\n"
    stream.write((row * len(values)) % tuple(values.ravel().tolist()))
    stream.flush()


def track_kinetic():
    """Kinetic energies [J], translational and rotational, that YADE has tracked so far.

    It adds up those of all steps in which ``O.trackEnergy`` was True, for all bodies but walls.
    """
    known = O.energy.keys()
    return [O.energy[name] if name in known else 0.0 for name in ("kinTrans", "kinRot")]


class PistonRecord:
    """``piston.txt``: a row every ``period`` steps, of the piston and the grains' energies."""

    HEADER = "step target_force_N contact_force_N height_m"
    HEADER += " kinetic_translational_J kinetic_rotational_J\n"

    def __init__(self, piston, gravity, period):
        """The engines call ``piston_record.before()`` and ``.behind()`` of the main script."""
        self.piston, self.gravity = piston, gravity
        self.stream = open("piston.txt", "w", encoding="ascii")
        self.stream.write(self.HEADER)
        self.row, self.tracked = (), (0.0, 0.0)
        when = {"iterPeriod": period, "iterLast": O.iter}
        self.watch = PyRunner(command="piston_record.before()", **when)
        self.watch_behind = PyRunner(command="piston_record.behind()", **when)

    def before(self):
        """In a step, when all forces are known and nothing has moved yet."""
        piston = self.piston
        self.row = (
            O.iter, piston.target_force(self.gravity), piston.contact_force(), piston.height,
        )  # fmt: skip
        self.tracked = track_kinetic()
        O.trackEnergy = True  # in this step only: in every one it would cost

    def behind(self):
        """In the same step, behind the integrator."""
        O.trackEnergy = False
        translational, rotational = np.subtract(track_kinetic(), self.tracked)
        translational -= 0.5 * self.piston.mass * self.piston.speed**2
        self._write(translational, rotational)

    def last(self, grains):
        """The instant at which the run ends, between two steps; ``grains`` as `tabulate_grains`."""
        self.before()
        O.trackEnergy = False
        self._write(*sum_kinetic_energies(grains))

    def _write(self, translational, rotational):
        row = (*self.row, translational, rotational)
        self.stream.write(("%d" + " %.17g" * 5 + "\n") % row)
        self.stream.flush()


def sum_kinetic_energies(grains):
    """Translational and rotational kinetic energy [J] of the grains of `tabulate_grains`."""
    mass, radius = grains[:, 10], grains[:, 9]
    translational = 0.5 * mass @ (grains[:, 3:6] ** 2).sum(axis=1)
    return translational, 0.2 * (mass * radius**2) @ (grains[:, 6:9] ** 2).sum(axis=1)


ROOM, ROOM_OF_BODY = 100_000, 3_000
"""Room for a saved scene [bytes], and for each body in it; a body takes about 1,000."""
SAVE_S = 600
"""Longest time to write one [s]."""


def save_scene():
    """Write ``end.restart`` as `write_scene`, without what belongs to this script."""
    O.engines = O.engines[:3]  # the commands of the others belong to this script
    write_scene("end.restart")


def write_scene(path):
    """Write the scene; raises OSError or EOFError when it is not whole, as on a full disk.

    On a full disk YADE would try to write for ever: so the room is asked for before.  Should
    another process take it just then, an alarm ends this one.
    """
    with open(SAVED, "wb") as stream:
        os.posix_fallocate(stream.fileno(), 0, ROOM + ROOM_OF_BODY * len(O.bodies))
    signal.alarm(SAVE_S)
    O.save(SAVED)
    signal.alarm(0)
    with gzip.open(SAVED) as stream:
        while stream.read(1 << 20):
            pass
    os.replace(SAVED, path)


def load_scene(path="start.restart"):
    """Read what `write_scene` wrote."""
    saved = "start.yade.gz"
    os.symlink(path, saved)
    try:
        O.load(saved)
    finally:
        os.remove(saved)
