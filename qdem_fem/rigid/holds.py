"""What a simulation's conditions are to its rigid bodies: loads, and freedoms that are held."""

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import RigidMass, make_cross_matrix
from qdem_fem.files import ConditionError, Floats, Integers
from qdem_fem.kernel.cpu import Constraints, Loads
from qdem_fem.rigid.step import FREE, STILL

LOOSE = 1e-9
"""Share of a freedom's motion below which a held component does not see it."""


def find_hold(
    own: RigidMass, arm: Floats, component: Integers, series: Integers, weight: Floats, where: str
) -> tuple[Integers, Floats, int]:
    """What the held components of some nodes leave of a body's freedoms: the series that each
    component of the shift follows (3,), -1 where it is free, the weight of each (3,), and `FREE`,
    an axis, or `STILL`.

    ``arm`` (h, 3) [m]: from the centre to the node of each; ``component`` (h,); it follows
    ``weight`` (h,) times ``series`` (h,).  What the six freedoms may still do is the null space of
    the components' motion.  It is taken where it is some of the three shifts with all turns about
    the centre, the turn about one axis of coordinates through it, or none; then no finite motion
    leaves it.  Raises `ConditionError` for any other, a hinge for example, and for components that
    follow different motions.
    """
    size = float(np.sqrt(own.inertia[-1] / own.mass))
    rows = np.concatenate([np.tile(np.eye(3), (len(arm), 1, 1)), -make_cross_matrix(arm / size)], 2)
    rows = rows[np.arange(len(arm)), component]
    triangle = np.linalg.qr(np.concatenate([rows, np.zeros((6, 6))]), mode="r")
    _, stretch, motions = np.linalg.svd(triangle)
    loose = motions[stretch < LOOSE * max(float(stretch.max()), 1.0)]
    left = loose.T @ loose
    mask = np.diag(left) > 0.5
    turns = mask[3:].sum()
    if abs(left - np.diag(mask)).max() > 1e-6 or turns == 2:
        raise ConditionError(
            "what is held leaves the rigid body a motion about its nodes, a hinge or a slope",
            where=where, remedy="hold components of all its nodes, or leave the body deformable",
        )  # fmt: skip
    given, share = np.full(3, -1), np.zeros(3)
    for k in range(3):
        mine = component == k
        asked = {(s if w else 0, w) for s, w in zip(series[mine], weight[mine], strict=True)}
        if len(asked) > 1:
            raise ConditionError(
                f"its nodes are to move apart along {'xyz'[k]}, and the body is rigid",
                where=where, remedy="prescribe one motion for all of them",
            )  # fmt: skip
        if not mask[k]:
            given[k], share[k] = asked.pop() if asked else (0, 0.0)
    turning = {0: STILL, 1: int(np.argmax(mask[3:])), 3: FREE}[int(turns)]
    return given, share, turning


def split_conditions(
    loads: Loads, held: Constraints, is_rigid: NDArray[np.bool_]
) -> tuple[Loads, Constraints, Loads, Constraints]:
    """The lists of deformable bodies, and those of rigid ones.

    ``is_rigid`` (n,) by the kernel's number of a node.
    """
    of_loads, of_held = is_rigid[loads.node_at // 4], is_rigid[held.node_at // 4]
    mine = _select_held(held, of_held)._replace(
        roller_at=np.zeros(0, np.int64), roller_normal=np.zeros((0, 3))
    )
    return (
        Loads(*(entry[~of_loads] for entry in loads)),
        _select_held(held, ~of_held),
        Loads(*(entry[of_loads] for entry in loads)),
        mine,
    )


def _select_held(held: Constraints, mask: NDArray[np.bool_]) -> Constraints:
    """Some of the held components, and all rollers."""
    names = ("node_at", "series", "weight", "previous")
    return held._replace(**{name: getattr(held, name)[mask] for name in names})
