"""Friction problems made to measure: towers of boxes, beds of discs and of spheres.

Each is one time step h of Moreau and Jean for bodies at rest under gravity with closed gaps:
``u = J v``, ``v = h g + M^-1 J^T r``, so ``q = J h g`` and r are impulses [N s].  Beds are poured
(`deposition`) and then settled by steps that forget their velocity, which ends in an equilibrium
with friction; they have some 4 (2D) or 5 to 6 (3D) contacts a grain, forces that
are far from unique, and few contacts that slide: the hyperstatic kind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from validation.bench.rigid.deposition import find_touching, pour_grains

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

GRAVITY = 9.81
DENSITY = 2000.0
"""Of the grains [kg/m^3], a disc being 1 m long."""
RADII = (0.035, 0.065)
"""Range of the grains' radii [m], uniform."""
TOUCH = 1e-3
"""Grains nearer than this part of the mean radius touch: their gap is taken for closed."""
SETTLE_STEPS = (2e-2, 2e-3)
"""First and last time step [s] of the settling: a free grain falls ``g h^2``, 4 mm to 40 um."""
SETTLE_SWEEPS = 40
OVERLAP_MENDED = 0.2
"""Part of an overlap that a step of the settling takes back."""


@dataclass(frozen=True)
class Bed:
    """Grains at rest in a box, planar (discs) or not, and the impulses of the last step."""

    centre: Floats
    """(n, 3) [m]; y = 0 in the plane."""
    radius: Floats
    width: float
    dim: int
    friction: float
    pairs: Integers
    """Touching grains (nc, 2), see `keep_touching`."""
    impulse: Floats
    """World impulses on the first of each pair in a step of 1 s, (nc, 3) [N s]."""
    unrest: float
    """Greatest speed that one step gives a grain, over g h: 0 in equilibrium, 1 in free fall."""


def build_tower(
    boxes: int, dim: int, *, top_mass: float = 1.0, friction: float = 0.5, step: float = 1e-3
) -> FrictionProblem:
    """Unit boxes of 1 kg on each other and the floor, the top one of ``top_mass`` times that.

    2 (2D) or 4 (3D) contacts a face; the rank of W is far below its size.
    """
    corners = np.array([[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]])
    arms = np.array([[0.5, 0.0], [-0.5, 0.0]]) if dim == 2 else corners
    arm = np.tile(np.column_stack([arms, np.full(len(arms), -0.5)]), (boxes, 1))
    above = np.repeat(np.arange(boxes), len(arms))
    normal = np.tile([0.0, 0.0, 1.0], (len(arm), 1))
    jacobian = build_jacobian(
        np.column_stack([above, above - 1]), normal, arm, arm * [1, 1, -1], boxes, dim
    )
    mass = np.ones(boxes)
    mass[-1] = top_mass
    space = build_bodies(jacobian, mass, mass / 6.0, dim)
    return pose_step(space, step, friction, dim)


def build_packing(
    grains: int,
    dim: int,
    *,
    seed: int = 0,
    friction: float = 0.5,
    step: float = 1e-3,
    settle: int = 200,
    folder: Path | None = None,
) -> FrictionProblem:
    """A settled bed of so many grains as a problem of one step, see `bed`."""
    made = pour_bed(grains, dim, seed=seed, friction=friction, settle=settle, folder=folder)
    return pose_bed(made, step)


def pour_bed(
    grains: int,
    dim: int,
    *,
    seed: int = 0,
    friction: float = 0.5,
    settle: int = 200,
    folder: Path | None = None,
) -> Bed:
    """Pour grains into a box about as wide as the bed is high, and settle it in ``settle`` steps.

    Kept in ``folder`` if one is named, and read from it the next time.
    """
    name = f"bed{dim}d_{grains}_{seed}_{friction:g}_{settle}.npz"
    if folder is not None and (folder / name).exists():
        return read_bed(folder / name)
    generator = np.random.default_rng(seed)
    radius = generator.uniform(*RADII, grains)
    made = pour_radii(radius, dim, generator, friction=friction, settle=settle)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Any] = vars(made)
        np.savez_compressed(folder / name, **arrays)
    return made


def pour_radii(
    radius: Floats, dim: int, generator: np.random.Generator, *, friction: float, settle: int = 200
) -> Bed:
    """Pour grains of these radii (n,) [m] at random places and settle them, see `bed`."""
    grains = len(radius)
    drop = generator.random((grains, 2))
    if dim == 2:
        drop[:, 1] = -1.0
    width = 2.0 * float(radius.mean()) * max(2.0, grains ** (1 / dim))
    width = max(width, 2.5 * float(radius.max()))
    centre = pour_grains(radius, width, drop)
    made = Bed(centre, radius, width, dim, friction, np.zeros((0, 2), int), np.zeros((0, 3)), 1.0)
    for k in range(settle):
        step = SETTLE_STEPS[0] * (SETTLE_STEPS[1] / SETTLE_STEPS[0]) ** (k / settle)
        made = settle_step(replace(made, friction=0.0 if 2 * k < settle else friction), step)
    return made


def build_crystal(layers: int, *, friction: float = 0.35, step: float = 1e-3) -> FrictionProblem:
    """Equal spheres in layers of squares, each in the hollows of the one below, in a box that
    touches all its sides (face-centred cubic): regular, where packings are not."""
    radius, centre = float(np.mean(RADII)), []
    for k in range(layers):
        along = radius * (1 + k % 2) + 2.0 * radius * np.arange(layers - k % 2)
        x, y = (each.ravel() for each in np.meshgrid(along, along))
        centre.append(np.column_stack([x, y, np.full(len(x), radius * (1.0 + np.sqrt(2.0) * k))]))
    place = np.concatenate(centre)
    made = Bed(
        place, np.full(len(place), radius), 2.0 * radius * layers, 3, friction,
        np.zeros((0, 2), int), np.zeros((0, 3)), 1.0,
    )  # fmt: skip
    return pose_bed(update_pairs(made, TOUCH * radius), step)


def read_bed(path: Path) -> Bed:
    """A bed from its file."""
    with np.load(path) as data:
        numbers = {key: data[key].item() for key in ("width", "dim", "friction", "unrest")}
        arrays = {key: data[key] for key in ("centre", "radius", "pairs", "impulse")}
    return Bed(**arrays, **numbers)


def settle_step(made: Bed, step: float) -> Bed:
    """One step from rest: free gaps may close, touching grains bear; then all velocity is lost."""
    margin = 2.0 * GRAVITY * step**2
    made = update_pairs(made, margin)
    problem = pose_bed(made, step, gaps=True)
    start = find_start(made, step)
    found = solve_gauss_seidel(problem, start, 1e-6, SETTLE_SWEEPS)
    space = problem.bodies
    assert space is not None
    fall = space.inverse_mass @ (space.jacobian.T @ found.r) + fall_freely(space, step, made.dim)
    velocity = fall.reshape(-1, space.body_size)[:, : made.dim]
    centre = made.centre.copy()
    centre[:, [0, 2] if made.dim == 2 else [0, 1, 2]] += step * velocity
    impulse = np.einsum("ci,cik->ck", found.r.reshape(-1, made.dim), find_frames(made)) / step
    unrest = float(np.linalg.norm(velocity, axis=1).max()) / (GRAVITY * step)
    return replace(made, centre=centre, impulse=impulse, unrest=unrest)


def update_pairs(made: Bed, margin: float) -> Bed:
    """Find the pairs within ``margin`` [m]; those known before keep their impulse."""
    pairs = find_touching(made.centre, made.radius, made.width, made.dim == 2, margin)
    keys, known = (each @ [len(made.radius) + 5, 1] for each in (pairs, made.pairs))
    impulse = np.zeros((len(pairs), 3))
    _, new, old = np.intersect1d(keys, known, assume_unique=True, return_indices=True)
    impulse[new] = made.impulse[old]
    return replace(made, pairs=pairs, impulse=impulse)


def keep_touching(made: Bed) -> Bed:
    """The same grains with those pairs only that touch."""
    kept = find_gaps(made) < TOUCH * made.radius.mean()
    return replace(made, pairs=made.pairs[kept], impulse=made.impulse[kept])


def pose_bed(made: Bed, step: float, *, gaps: bool = False) -> FrictionProblem:
    """The problem of a step [s]: of the pairs that touch, or of all with what gaps they have.

    A gap g leaves ``u_N >= -g / h``, and an overlap asks for a part of it back.
    """
    made = made if gaps else keep_touching(made)
    apart = find_gaps(made)
    radius, first, second = made.radius, made.pairs[:, 0], made.pairs[:, 1]
    frames = find_frames(made)
    other = np.where(second < 0, 0.0, radius[np.maximum(second, 0)])
    jacobian = build_jacobian(
        made.pairs, frames[:, 0], -radius[first, None] * frames[:, 0], other[:, None]
        * frames[:, 0], len(radius), made.dim, frames,
    )  # fmt: skip
    mass = DENSITY * np.pi * radius**2 * (1.0 if made.dim == 2 else 4.0 / 3.0 * radius)
    inertia = mass * radius**2 * (0.5 if made.dim == 2 else 0.4)
    problem = pose_step(build_bodies(jacobian, mass, inertia, made.dim), step, made.friction,
                           made.dim)  # fmt: skip
    if gaps:
        problem.offset[:: made.dim] += np.where(apart > 0, apart, OVERLAP_MENDED * apart) / step
    return problem


def find_start(made: Bed, step: float) -> Floats:
    """Impulses of the step before in the frames of this one, (nc * dim,): a warm start."""
    return np.einsum("ck,cik->ci", made.impulse, find_frames(made)).ravel() * step


def find_frames(made: Bed) -> Floats:
    """Normal, from the second to the first of a pair, and tangents: (nc, dim, 3)."""
    first, second = made.pairs[:, 0], made.pairs[:, 1]
    normal = made.centre[first] - made.centre[np.maximum(second, 0)]
    walls = np.array([[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=float)
    normal[second < 0] = walls[-1 - second[second < 0]]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    if made.dim == 2:
        return np.stack([normal, np.column_stack([-normal[:, 2], normal[:, 1], normal[:, 0]])], 1)
    away = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    tangent = np.cross(away, normal)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return np.stack([normal, tangent, np.cross(normal, tangent)], 1)


def find_gaps(made: Bed) -> Floats:
    """Gap of every pair [m], (nc,)."""
    first, second = made.pairs[:, 0], made.pairs[:, 1]
    between = made.centre[first] - made.centre[np.maximum(second, 0)]
    gap = np.linalg.norm(between, axis=1) - made.radius[first] - made.radius[np.maximum(second, 0)]
    place, radius = made.centre[first], made.radius[first]
    sides = np.stack([place[:, 2], place[:, 0], made.width - place[:, 0], place[:, 1],
                      made.width - place[:, 1]])  # fmt: skip
    wall = second < 0
    gap[wall] = sides[-1 - second[wall], np.flatnonzero(wall)] - radius[wall]
    return gap


def build_jacobian(
    pairs: Integers, normal: Floats, arm_first: Floats, arm_second: Floats, bodies: int, dim: int,
    frames: Floats | None = None,
) -> sp.csr_array:  # fmt: skip
    """J (nc * dim, bodies * 3 or 6): ``u . d = d . (v_a + w_a x s_a - v_b - w_b x s_b)``.

    ``arm_first``, ``arm_second`` (nc, 3) [m]: from the centres to the contact; the plane is x, z.
    """
    contacts, size = len(pairs), 3 * dim - 3
    if frames is None:
        frames = np.tile(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])[:dim], (contacts, 1, 1))
    block = np.zeros((contacts, 2, dim, size))
    for side, arm, sign in ((0, arm_first, 1.0), (1, arm_second, -1.0)):
        turn = np.cross(arm[:, None, :], frames)
        # in the plane phi turns x to z, against y
        parts = [frames[..., [0, 2]], -turn[..., [1]]] if dim == 2 else [frames, turn]
        block[:, side] = sign * np.concatenate(parts, axis=2)
    kept = pairs.ravel() >= 0
    start = np.concatenate([[0], np.cumsum(kept.reshape(-1, 2).sum(axis=1))])
    jacobian = sp.bsr_array(
        (block.reshape(-1, dim, size)[kept], pairs.ravel()[kept], start),
        shape=(contacts * dim, bodies * size),
    )
    rows = sp.csr_array(jacobian)
    rows.eliminate_zeros()
    rows.sort_indices()
    return rows


def build_bodies(jacobian: sp.csr_array, mass: Floats, inertia: Floats, dim: int) -> BodySpace:
    """Bodies whose inertia is the same about every axis, (n,) [kg], [kg m^2]."""
    columns = [mass] * dim + [inertia] * (2 * dim - 3)
    inverse = 1.0 / np.stack(columns, axis=1).ravel()
    return BodySpace(jacobian, sp.csr_array(sp.diags(inverse)), 3 * dim - 3)


def fall_freely(space: BodySpace, step: float, dim: int) -> Floats:
    """Velocities of bodies from rest after one step without contact, (ndof,) [m/s]."""
    velocity = np.zeros(space.jacobian.shape[1])
    velocity[dim - 1 :: space.body_size] = -GRAVITY * step
    return velocity


def pose_step(space: BodySpace, step: float, friction: float, dim: int) -> FrictionProblem:
    """One step from rest under gravity: ``q = J h g``."""
    offset = space.jacobian @ fall_freely(space, step, dim)
    problem = make_problem(space, offset, friction, dim)
    assert isinstance(problem, FrictionProblem)
    return problem
