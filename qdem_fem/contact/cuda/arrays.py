"""What contact of spheres remembers on a GPU, the launches of a step, and its lists made again.

Arrays are those of `qdem_fem.contact.spheres.law.Contact`, and stay on the GPU: neither a step nor
a look for pairs moves one to the host, which reads counts and greatest values alone.
"""

from typing import Any

import numpy as np

from qdem_fem.contact.cuda import law
from qdem_fem.contact.cuda.pairs import renew_pairs
from qdem_fem.contact.search import Pairs, PeriodicWidth
from qdem_fem.contact.spheres import GO_ON, LOOK_AGAIN, TOO_DEEP, Contact, Planes, Spheres
from qdem_fem.kernel.cuda import AGAIN, DEEP, choose_grid, cuda


def copy_to_device(array: Any) -> Any:
    """An array on the GPU, with one row of zeros in place of none: it had better not be empty."""
    shape = tuple(max(length, 1) for length in array.shape)
    full = array if array.size else np.zeros(shape, array.dtype)
    return cuda.to_device(np.ascontiguousarray(full))


def copy_to_host_array(array: Any, length: int) -> Any:
    """The first rows of an array of the GPU, not to be written to."""
    found = array.copy_to_host()[:length]
    found.flags.writeable = False
    return found


class DeviceContact:
    """The arrays of a `Contact` on the GPU, and the launches of a step."""

    def __init__(self, c: Contact, side: PeriodicWidth | None) -> None:
        self.on = Contact(
            Spheres(*map(copy_to_device, c.spheres)), Pairs(*map(copy_to_device, c.pairs)),
            Planes(*map(copy_to_device, c.planes)), float(c.friction), float(c.half_skin),
            *map(copy_to_device, c[5:]),
        )  # fmt: skip
        """Every array on the GPU, of at least one row."""
        self.side = side
        self.walls, self.acting, self.size = len(c.planes.point), len(c.pairs.acting), len(c.start)
        self.largest = float(c.spheres.radius.max())
        self.said = GO_ON

    # --- the steps of a window -----------------------------------------------------------------

    def launch_push(self, forces: Any, status: Any, k: int) -> None:
        """Forces found in the step before reach the nodes."""
        c = self.on
        law.push_forces[choose_grid(self.acting)](
            self.acting, c.pairs.acting, c.spheres.place, c.force, forces, status, k
        )

    def launch_step(
        self, displacement: Any, velocity: Any, status: Any, step: float, k: int
    ) -> None:
        """Contact at the new displacement, as `qdem_fem.contact.spheres.law.build_advance`'s."""
        c, (s, p, w, *_), few = self.on, self.on, choose_grid(self.acting)
        law.move_spheres[choose_grid(self.size)](
            s.reference, s.place, displacement, c.start, c.half_skin, c.position, status, k
        )
        law.build_pairs_forces(self.side is not None)[few](
            self.acting, p.acting, p.first, p.second, p.touching, p.spring, p.pull, p.image,
            c.position, s.radius, s.normal, s.tangential, s.place, velocity, c.friction, c.force,
            c.slid, status, step, k,
        )  # fmt: skip
        if self.walls:
            law.compute_walls_forces[few](
                self.acting, p.acting, p.wall_first, p.wall, w.point, w.normal, w.friction,
                w.spring, w.force, c.position, s.radius, s.normal, s.tangential, s.place, velocity,
                c.force, c.slid, status, step, k,
            )  # fmt: skip
        law.add_reactions[few](
            self.acting, p.acting, p.back_first, p.back_pair, p.touching, p.pull, c.force, status,
            k,
        )  # fmt: skip

    def end(self, status: list[int]) -> None:
        """What the last step of a window said, from its status."""
        self.said = TOO_DEEP if status[DEEP] else LOOK_AGAIN if status[AGAIN] else GO_ON

    def step_contact(self, displacement: Any, velocity: Any, step: float) -> int:
        """Contact at a displacement to which a ``step`` [s] led; what it says."""
        status = cuda.to_device(np.array([0, 1, 0, 0], dtype=np.int32))
        self.launch_step(displacement, velocity, status, step, 0)
        self.end(status.copy_to_host().tolist())
        return self.said

    # --- between windows -----------------------------------------------------------------------

    def renew_lists(self, position: Any, skin: float, half_skin: float) -> None:
        """List what is within ``skin`` [m] at (c, 3) [m], good for ways of ``half_skin`` [m]."""
        pairs, self.acting = renew_pairs(
            self.on, position, skin, self.largest, self.walls, self.side
        )
        self.on.start.copy_to_device(position)
        self.on = self.on._replace(pairs=pairs, half_skin=half_skin)

    def forget(self) -> None:
        """Let go of all springs."""
        c = self.on
        for array in (c.pairs.touching, c.force, c.planes.spring, c.planes.force):
            array.copy_to_device(np.zeros(tuple(array.shape), array.dtype))

    def fetch(self, c: Contact) -> Contact:
        """``c`` with copies, not to be written to, of what steps and looks for pairs change."""
        first, _, back_first, *_, wall_first, wall = self.on.pairs
        first, back_first, wall_first = (
            copy_to_host_array(a, self.size + 1) for a in (first, back_first, wall_first)
        )
        rows = int(first[-1])
        listed = {
            name: copy_to_host_array(getattr(self.on.pairs, name), rows)
            for name in ("second", "back_pair", "touching", "spring", "pull")
        }
        image = (
            c.pairs.image if self.side is None else copy_to_host_array(self.on.pairs.image, rows)
        )
        pairs = Pairs(
            **listed, first=first, back_first=back_first, wall_first=wall_first, image=image,
            wall=copy_to_host_array(wall, int(wall_first[-1])),
            acting=copy_to_host_array(self.on.pairs.acting, self.acting),
        )  # fmt: skip
        planes = c.planes._replace(
            spring=copy_to_host_array(self.on.planes.spring, self.walls),
            force=copy_to_host_array(self.on.planes.force, self.walls),
        )
        moving = {
            name: copy_to_host_array(getattr(self.on, name), self.size)
            for name in ("start", "position", "force", "slid")
        }
        return c._replace(pairs=pairs, planes=planes, half_skin=self.on.half_skin, **moving)
