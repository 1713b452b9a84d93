"""Which stages of the default plan pay: each is taken away in turn, on problems of new seeds.

    python -m validation.studies.rigid_solvers.ablation     # goes on where it stopped

Rule: a stage leaves that ends less than 1 % of the problems and saves less than 10 % of the time.
A stage is taken away on the problems that the whole plan solves and in which it was tried: on
others nothing changes.
"""

from __future__ import annotations

import csv
import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from rigid_lcp.friction.auto import plan, solve
from rigid_lcp.friction.auto.plan import Stage
from rigid_lcp.friction.auto.trial import Trial
from validation.bench.rigid import examination_beds as beds
from validation.bench.rigid.examination import FAMILIES, Family
from validation.bench.rigid.examination_beds import Generator, Posed
from validation.bench.rigid.friction_problems import renew_bodies
from validation.studies.rigid_solvers.run import load_kernels

SEEDS, EVERY, ROUGH = (9201, 9202, 9203, 9204, 9205), 8, 1e-6
"""Seeds never used, which of a family's problems are posed of each, and a rough tolerance [-]."""
POSING = ("family", "seed", "number")
COLUMNS = ("contacts", "without", "status", "residual", "cpu_s", "tried", "ended_by")


def pose_yielding(generator: Generator, index: int) -> Posed:
    """A bed under 0.4 to 0.8 of the friction it settled with, where many contacts slide."""
    posed = beds.draw_bed(generator, 2 + index % 2, (100, 1300))
    friction = generator.uniform(0.4, 0.8) * posed.problem.friction
    return replace(posed, problem=replace(posed.problem, friction=friction))


def pose_moving(generator: Generator, index: int) -> Posed:
    """The next step of a large bed that was kicked, from the forces of the one before."""
    posed = beds.kick_posed(beds.draw_bed(generator, 2 + index % 2, (350, 4000)), generator)
    first, space = posed.problem, beds.require_bodies(posed)
    before = solve.solve_friction(space, first.offset, first.friction, first.dim)
    push = space.jacobian @ generator.standard_normal(space.jacobian.shape[1])
    push *= beds.draw_between(generator, 1e-3, 1e-1) * np.linalg.norm(first.offset)
    offset = first.offset + push / np.linalg.norm(push)
    return replace(posed, problem=replace(first, offset=offset), start=before.r)


def pose_rough(generator: Generator, index: int) -> Posed:
    """A large bed, at rest or moving, of which only a rough answer is asked."""
    make = pose_moving if index // 2 % 2 else beds.pose_large
    return replace(make(generator, index), bar=ROUGH)


POSED = [family for family in FAMILIES if not family.needs or family.needs in os.environ]
POSED += [Family("near yield", "", 60, pose_yielding), Family("moving", "", 60, pose_moving),
          Family("rough", "", 60, pose_rough)]  # fmt: skip


def watch(rows: tuple[Stage, ...], without: str, tried: list[str], ended: list[str]) -> Any:
    """A plan without a stage, whose stages note that they were tried, and that they ended it."""

    def note(stage: Stage) -> Stage:
        made = stage.attempt
        if isinstance(made, tuple):
            return replace(stage, attempt=watch(made, without, tried, ended))

        def attempt(trial: Trial) -> bool:
            tried.append(stage.name)
            done = made(trial)
            ended.extend([stage.name] * done)
            return done

        return replace(stage, attempt=attempt)

    return tuple(note(stage) for stage in rows if stage.name != without)


def measure(posed: Posed, without: str = "none") -> dict[str, Any]:
    """One problem, by the plan without a stage."""
    tried, ended, problem = list[str](), list[str](), posed.problem
    w = problem.delassus if problem.bodies is None else renew_bodies(problem)
    whole, first = (watch(rows, without, tried, ended) for rows in (plan.PLAN, plan.FIRST))
    with patch.object(plan, "PLAN", whole), patch.object(solve, "FIRST", first):
        begun = time.thread_time()
        found = solve.solve_friction(
            w, problem.offset, problem.friction, problem.dim, posed.start, posed.bar
        )
        cost = time.thread_time() - begun
    row = (problem.contacts, without, found.status, f"{found.residual:.1g}", f"{cost:.4f}",
           *("; ".join(dict.fromkeys(names)) for names in (tried, ended)))  # fmt: skip
    return dict(zip(COLUMNS, row, strict=True))


if __name__ == "__main__":
    load_kernels()
    path = Path(__file__).with_suffix(".csv")
    path.touch()
    done = {tuple(line.split(",")[:3]) for line in path.read_text().split("\n")}
    with path.open("a", newline="", encoding="utf-8") as file:
        rows = csv.DictWriter(file, POSING + COLUMNS)
        if POSING not in done:
            rows.writeheader()
        for seed, family in ((seed, family) for seed in SEEDS for family in POSED):
            for number in range(seed % EVERY, family.count, EVERY):
                named = (family.name, str(seed), str(number))
                if named in done:
                    continue
                posed = family.pose(seed, number)
                measure(posed)  # compiles and loads what it needs
                found = [measure(posed)]
                if found[0]["status"] == "solved":
                    found += [measure(posed, name) for name in found[0]["tried"].split("; ")]
                rows.writerows(dict(zip(POSING, named, strict=True)) | row for row in found)
                file.flush()
