"""What the two differences between LIGGGHTS and eqs 5 to 7 do to a bed under load cycles."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid

from adapters.contact_law import restitution_literal, tangential_stiffness
from adapters.dump import Frame, dump_frames
from adapters.engine import EngineStart, engine_named
from adapters.procedure import run_variant
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.stages import Variant
from adapters.state import FloatArray, IntArray, state_load
from adapters.window import piston_track_read
from scenes import scene_path
from validation.few_grains import shear_modulus

SEPARATION = 1e-10
"""By how much one grain of a twin is moved after the first cycle, times the twin's number [m]."""

SLIDING = 0.999
"""Share of Coulomb's limit from which on a contact counts as sliding."""

DENSE_OUTPUT = """\
dump contacts all local {every} contacts.dump {columns}
dump_modify contacts first yes format "%.0f %.0f{format}"
"""
"""Pair, normal force, tangential spring, overlap."""

Table = dict[tuple[int, int], tuple[float, float, float]]
"""Tangential stiffness [N/m], length of the tangential spring [m], mu F_n [N] of each contact."""


def bed_scene(seed: int, cycles: int, *overrides: str) -> Scene:
    """400 grains of the coarse scene, as deep as its 150; the first cycle in a window of its own.

    The 150 themselves stray too far: twins differ by as much as they settle in 15 cycles.
    """
    sample = [f"sample.seed={seed}", "sample.count=400", "sample.radius=0.049"]
    procedure = [f"procedure.total_cycles={cycles}", f"procedure.k={cycles - 1}"]
    procedure += ["procedure.k_i=1", "procedure.h=1"]
    return scene_load(
        scene_path("karrech-coarse"),
        [*sample, *procedure, "loading.piston_mass=0.0267", *overrides],
    )


def settlements(home: Path, seed: int, members: int, cycles: int) -> tuple[FloatArray, FloatArray]:
    """Settlement from cycle 1 to ``cycles`` [m], shape (members,) each: two ways to damp one bed.

    First with e = 0.2145, the restitution of the paper's alpha, then with e = 0.1776, a literal
    eq. 7.  All runs share the sample, its rain and cycle 1, with e = 0.2145; the twins of either
    kind differ by `SEPARATION` and show how far a chaotic bed strays by itself.
    """
    paper = bed_scene(seed, cycles)
    alpha = paper.material.grain.viscous_alpha
    assert alpha is not None
    restitution = f"material.grain.restitution={restitution_literal(alpha)!r}"
    literal = bed_scene(seed, cycles, restitution)
    folder, progress = RunFolder(home), Progress(quiet=True)
    with folder.locked():
        plain = run_variant(folder, paper, Variant(jumps=False), progress)
        runs = [plain]
        for name, scene, first in (("paper", paper, 1), ("literal", literal, 0)):
            for twin in range(first, members):
                moved = SEPARATION * (twin + 1)
                variant = Variant(f"{name}_{twin}", jumps=False, perturbation=moved)
                runs.append(run_variant(folder, scene, variant, progress))
    settled = np.array([_settlement(run, cycles) for run in runs])
    return settled[:members], settled[members:]


def _settlement(run: RunFolder, cycles: int) -> float:
    rows = {row["cycle"]: row["settlement"] for o in run.outcomes() for row in o.rows}
    return float(rows[cycles] - rows[1])


@dataclass(frozen=True)
class SpringEnergy:
    """Energy of the tangential springs between grains that stick, in one load cycle."""

    created: float
    """Created by F_t = k_t delta_t while k_t grows [J]."""
    lost: float
    """Lost by it while k_t falls [J]."""
    piston_work: float
    """Work of the piston on the bed [J]."""

    @property
    def created_share(self) -> float:
        """``created`` over the piston's work."""
        return self.created / self.piston_work

    @property
    def lost_share(self) -> float:
        """``lost`` over the piston's work."""
        return self.lost / self.piston_work


def spring_energy(home: Path, seed: int, cycles: int, every: int) -> SpringEnergy:
    """Follow every contact of the bed of `settlements` through one more cycle.

    F_t = k_t delta_t takes up the work F_t d delta_t = d(k_t delta_t^2/2) - delta_t^2/2 d k_t: a
    stiffness that grows by d k_t gives delta_t^2/2 d k_t for nothing.  Contacts are compared
    ``every`` so many steps.  Sliding ones are left out: they carry mu F_n under any rule.
    """
    scene, folder = bed_scene(seed, cycles), RunFolder(home)
    outcome = folder.outcome("window_000001")
    assert outcome is not None
    start = EngineStart(
        home / "window_000001" / "end.restart",
        outcome.notes["time_step"],
        outcome.notes["piston_mesh"],
        outcome.notes["piston_height"],
    )
    engine, work = engine_named("liggghts"), home / "dense"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    digests = engine.write_cycles(scene, start, 1, work)
    columns = " ".join(f"c_contact[{i}]" for i in (1, 2, 4, 5, 6, 10, 11, 12, 13))
    (work / "output_frictional.in").write_text(
        DENSE_OUTPUT.format(every=every, columns=columns, format=" %.9g" * 7)
    )
    engine.run(scene, "in.cycles", work, lambda: None, digests)
    state = state_load(home / "preparation" / "state.npz")
    table = _table_of(
        state.identifier, state.radius, shear_modulus(scene), scene.material.grain.friction
    )
    gifts = []
    before: Table = {}
    for frame in dump_frames(work / "contacts.dump"):
        now = table(frame)
        for pair in before.keys() & now.keys():
            (k0, s0, limit0), (k1, s1, limit1) = before[pair], now[pair]
            if k0 * s0 < SLIDING * limit0 and k1 * s1 < SLIDING * limit1:
                gifts.append((s0**2 + s1**2) / 4 * (k1 - k0))
        before = now
    piston = piston_track_read(work / "piston.txt")
    height = np.concatenate([[start.piston_height], piston.height])
    force = np.concatenate([piston.contact_force[-1:], piston.contact_force])
    gift = np.array(gifts)
    return SpringEnergy(
        float(gift[gift > 0].sum()),
        float(-gift[gift < 0].sum()),
        -float(trapezoid(force, height)),
    )


def _table_of(
    identifier: IntArray, radius: FloatArray, shear: float, friction: float
) -> Callable[[Frame], Table]:
    def table(frame: Frame) -> Table:
        pair = np.sort(frame.values[:, :2].astype(np.int64), axis=1)
        first, second = radius[np.searchsorted(identifier, pair)].T
        stiffness = tangential_stiffness(
            frame.values[:, -1], shear, first * second / (first + second)
        )
        spring = np.linalg.norm(frame.values[:, 5:8], axis=1)
        limit = friction * np.linalg.norm(frame.values[:, 2:5], axis=1)
        rows = np.column_stack([stiffness, spring, limit]).tolist()
        return {(i, j): tuple(row) for (i, j), row in zip(pair.tolist(), rows, strict=True)}

    return table
