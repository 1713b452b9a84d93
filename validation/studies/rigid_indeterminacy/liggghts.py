"""LIGGGHTS on scenes of equal discs: spheres in one plane, equal springs at all contacts.

Linear springs (``hooke/stiffness``), tangential ones with history; walls are its primitive planes;
gravity is a variable that grows.  The forces at rest are read from its dumps.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
from math import pi, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from validation.bench.rigid.static_grains import Grains

Floats = NDArray[np.float64]

DAMPING = 0.7
"""Contact damping in units of ``(k / m)^1/2``."""
DECK = """atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
read_data grains.data
neighbor 0.5 bin
neigh_modify delay 0
fix m1 all property/global kn peratomtypepair 1 {kn:.17g}
fix m2 all property/global kt peratomtypepair 1 {kt:.17g}
fix m3 all property/global gamman peratomtypepair 1 {gamma:.17g}
fix m4 all property/global gammat peratomtypepair 1 {gamma:.17g}
fix m5 all property/global coefficientFriction peratomtypepair 1 {friction:.17g}
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
{walls}fix integrate all nve/sphere
variable pull equal "{gravity:.17g}*((step<{ramp})*step/{ramp}+(step>={ramp}))"
fix gravity all gravity v_pull vector {gx:.17g} 0.0 {gz:.17g}
timestep {step:.17g}
compute pairs all pair/gran/local id force
thermo_style custom step atoms ke
thermo_modify lost error norm no
thermo {steps}
run {steps}
dump pairs all local 1 pairs.dump c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[6]
dump_modify pairs format "%.17g %.17g %.17g %.17g"
{dumps}run 0
print "DONE $(step)"
"""


def has_liggghts() -> bool:
    """Whether the program is installed."""
    return shutil.which("liggghts") is not None


def settle_liggghts(
    grains: Grains, stiffness: float, friction: float, *, tangential: float = 1.0,
    ramp: int = 0, steps: int = 40_000,
) -> tuple[Floats, float, float]:  # fmt: skip
    """Forces on body a along (n, t) at rest (nc, 2) [N], the greatest force out of balance over
    the weight, and the processor time of the program [s].

    For discs of 1 m radius, round against round or against a face of the fixed body.
    """
    h = 0.1 * sqrt(float(grains.mass.min()) / stiffness)
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        walls, dumps, planes = _format_walls(grains)
        size = float(np.linalg.norm(grains.gravity))
        (home / "grains.data").write_text(_format_data(grains))
        (home / "deck.in").write_text(DECK.format(
            kn=stiffness, kt=tangential * stiffness, friction=friction, walls=walls, dumps=dumps,
            gamma=2 * DAMPING * sqrt(stiffness / float(grains.mass.mean())),
            gravity=size, gx=grains.gravity[0] / size, gz=grains.gravity[1] / size,
            ramp=max(ramp, 1), step=h, steps=steps,
        ))  # fmt: skip
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            ["liggghts", "-in", "deck.in"], cwd=home, capture_output=True, text=True, timeout=300,
            check=False, env=os.environ | {"OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if f"DONE {steps}" not in done.stdout:
            raise RuntimeError(f"LIGGGHTS did not finish: {done.stdout[-400:]}")
        force = _read_forces(grains, home, planes)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    total = np.zeros((len(grains.mass) + 1, 2))
    np.add.at(total, grains.body_a, force)
    np.add.at(total, grains.body_b, -force)
    total[:-1] += grains.mass[:, None] * grains.gravity
    normal = _find_normals(grains)
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    parts = np.column_stack([(force * normal).sum(axis=1), (force * tangent).sum(axis=1)])
    return parts, float(np.abs(total[:-1]).max()) / grains.weight, cpu


def _find_normals(grains: Grains) -> Floats:
    centre = np.vstack([grains.centre, np.zeros((1, 2))])
    between = centre[grains.body_a] + grains.place_a - centre[grains.body_b] - grains.place_b
    round_b = ~grains.face.any(axis=1)
    normal = grains.face.copy()
    normal[round_b] = between[round_b] / np.linalg.norm(between[round_b], axis=1)[:, None]
    return normal


def _format_data(grains: Grains) -> str:
    wide = 4.0 * len(grains.mass) ** 0.5 + 10.0 + float(np.abs(grains.centre).max())
    density = grains.mass / (4.0 / 3.0 * pi)
    atoms = [
        f"{i + 1} 1 2.0 {density[i]:.17g} {x:.17g} 0 {z:.17g}"
        for i, (x, z) in enumerate(grains.centre)
    ]
    box = [f"{-wide:g} {wide:g} {axis}lo {axis}hi" for axis in "xyz"]
    head = ["discs", "", f"{len(atoms)} atoms", "1 atom types", *box, "", "Atoms", ""]
    return "\n".join([*head, *atoms]) + "\n"


def _format_walls(grains: Grains) -> tuple[str, str, list[int]]:
    """Lines of the walls, of their dumps, and for each wall its contacts' first row."""
    walls, dumps = "", ""
    rows: list[int] = []
    done: set[tuple[float, float]] = set()
    for c in np.flatnonzero(grains.face.any(axis=1)):
        axis = int(np.argmax(np.abs(grains.face[c])))
        place = float(grains.place_b[c, axis])
        if (float(axis), place) in done:
            continue
        done.add((float(axis), place))
        name = f"wall{len(rows)}"
        walls += (
            f"fix {name} all wall/gran model hooke/stiffness tangential history primitive type 1 "
            f"{'xz'[axis]}plane {place:.17g} store_force yes\n"
        )
        dumps += (
            f"dump {name} all custom 1 {name}.dump id f_force_{name}[1] f_force_{name}[3]\n"
            f'dump_modify {name} sort id format "%d %.17g %.17g"\n'
        )
        rows.append(int(c))
    return walls, dumps, rows


def _read_forces(grains: Grains, home: Path, planes: list[int]) -> Floats:
    """Forces on body a as vectors (nc, 2) [N]."""
    force = np.zeros((len(grains.body_a), 2))
    number = {
        (int(a), int(b)): c
        for c, (a, b) in enumerate(zip(grains.body_a, grains.body_b, strict=True))
        if not grains.face[c].any()
    }
    for first, second, fx, fz in _read_table(home / "pairs.dump"):
        i, j = int(first) - 1, int(second) - 1
        if (i, j) in number:
            force[number[i, j]] = fx, fz
        elif (j, i) in number:
            force[number[j, i]] = -fx, -fz
    for wall, first_row in enumerate(planes):
        on_wall = _read_table(home / f"wall{wall}.dump")
        same = (grains.face == grains.face[first_row]).all(axis=1)
        for c in np.flatnonzero(same):
            force[c] = on_wall[grains.body_a[c], 1:]
    return force


def _read_table(path: Path) -> Floats:
    lines = path.read_text().splitlines()
    begin = max(k for k, line in enumerate(lines) if line.startswith("ITEM: ")) + 1
    return np.array([[float(word) for word in line.split()] for line in lines[begin:]])
