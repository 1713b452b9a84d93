"""The page on the validation of QDEM, written from its record.

    python -m validation.qdem_validation_page        writes docs/qdem-validation.md

The words are in ``qdem_validation_page.md`` beside this file; every figure in them is looked up, as
``[[part | how the check's name begins | format]]``.  A test holds the page to the record.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.case import Check
from validation.qdem_record import RECORD, ROOT, checks_of, record_lines, write_atomically

WORDS = Path(__file__).with_suffix(".md")
PAGE_PATH = ROOT / "docs" / "qdem-validation.md"
FIGURE = re.compile(r"\[\[([^|\]]+) \| ([^|\]]+) \| ([^|\]]+?)( \| last)?\]\]")
"""Part, how the check's name begins, format; the last check of such a name instead of the first."""
Parts = dict[str, list[Check]]


@dataclass(frozen=True)
class Point:
    """A row of the table: what is asked, and the checks of a part that answer it."""

    words: str
    part: str
    starts: tuple[str, ...]
    """How the names of the checks begin; of several, the one nearest to its bar is shown."""
    how: str


BIG = "488,400 elements"
SAME = "scikit-fem, same mesh, CG with multigrid, refined"
POINTS = (
    Point("**Static cantilever**: tip, same mesh", "paper size, relaxed",
          (f"{BIG}, relaxed: tip, QDEM",), f"{BIG}, conjugate relaxation; {SAME}"),
    Point("von Mises stress, element by element, mean difference", "paper size, relaxed",
          (f"{BIG}, relaxed: von Mises, mean",), "the same; the paper's own figure is the bar"),
    Point("the same, greatest difference", "paper size, relaxed",
          (f"{BIG}, relaxed: von Mises, greatest",), "the same"),
    Point("tip by motion in time, same mesh", "paper size, settled",
          (f"{BIG}, settled: tip, QDEM",), "smooth step over 2 first periods, mean over one more"),
    Point("von Mises stress by motion in time, greatest difference", "paper size, settled",
          (f"{BIG}, settled: von Mises, greatest",), "the same"),
    Point("the two on 46,080 elements: tip", "static",
          ("46,080 elements, settled: tip, QDEM", "46,080 elements, relaxed: tip, QDEM"),
          "mean over two periods; conjugate relaxation"),
    Point("tip at the paper's number of elements", "paper size, relaxed",
          (f"{BIG}: tip, the paper's",), "222 x 22 x 20 cells of five tetrahedra"),
    Point("order of convergence, six tetrahedra a cell", "static",
          ("six tetrahedra a cell, to 62,208: order",),
          "excess stiffness to quadratic elements over four meshes"),
    Point("order of convergence, five tetrahedra a cell", "static",
          ("five tetrahedra a cell, to 51,840: order",), "the same"),
    Point("tips on these meshes, worst", "static",
          ("six tetrahedra a cell, to 62,208: tips", "five tetrahedra a cell, to 51,840: tips"),
          "scikit-fem, same mesh"),
    Point("tip by quadratic tetrahedra", "static", ("tip by quadratic tetrahedra",),
          "scikit-fem, 72 x 8 x 8 cells"),
    Point("tip by Euler-Bernoulli, eq. 12", "static", ("tip by Euler-Bernoulli",), "closed form"),
    Point("tip by Timoshenko", "static", ("tip by Timoshenko",), "closed form, Cowper's shear"),
    Point("mean tip under load as the paper averages it", "protocol",
          ("as the paper, 10,800 elements: mean tip under load, QDEM to Newmark",),
          "1 s of ramp, mean from 1 to 2 s, both methods"),
    Point("**Vibration after unloading**: first frequency", "paper size, vibration",
          (f"{BIG}: first frequency to same mesh",), "eigenvalue of (K, lumped M), LOBPCG"),
    Point("first frequency, the paper's", "paper size, vibration",
          (f"{BIG}: first frequency, the paper's",), "damped cosines fitted to two periods"),
    Point("five modes, worst", "vibration",
          tuple(f"46,080 elements: mode {n}" for n in range(1, 6)),
          "one skew release; eigenvalues of the same mesh"),
    Point("decay of an elastic motion, over its frequency", "vibration",
          ("46,080 elements: decay of an elastic",), "fit; exact: 0"),
    Point("decay with viscosity, of the first bending mode", "vibration",
          ("2,304 elements: decay with viscosity",), "phi C phi/2 of the same mesh"),
    Point("history after unloading to Newmark's", "protocol",
          ("as the paper, 10,800 elements: history",), "200 steps a period, average acceleration"),
    Point("history to the exact one (all modes)", "motion",
          ("unloading, QDEM at 0.9",), "2,304 elements, eigenvectors by LAPACK"),
    Point("order in the time step", "motion", ("motion, QDEM: order",), "the same"),
    Point("**Energy**: drift of the leapfrog invariant, linear law", "energy",
          ("energy, small strain",), "a million steps; K of scikit-fem"),
    Point("order of the wavering in the step, least", "energy",
          ("energy, finger: order", "energy, svk: order", "energy, corotational: order"),
          "three laws with a potential, strains of some per cent"),
    Point("band of the energy to that of the first tenth", "energy",
          ("energy, finger: band", "energy, svk: band", "energy, corotational: band"),
          "100,000 steps at 0.4 of the critical step"),
    Point("**Viscosity**: decay of the thickness mode", "viscous",
          tuple(f"thickness mode, {v} Pa s: decay to" for v in (10000, 30000, 100000)),
          "(4/3) k² mu_D/(2 rho), a decade of viscosities"),
    Point("creep, uniaxial strain", "viscous",
          ("creep, uniaxial strain, to closed form",), "time 4/3 mu_D/E"),
    Point("recovery, uniaxial strain", "viscous", ("recovery, uniaxial strain",), "the same"),
    Point("creep, uniaxial stress", "viscous",
          ("creep, uniaxial stress, to closed form",), "1/3 at once, 2/3 in 2 mu_D/E"),
    Point("recovery, uniaxial stress", "viscous", ("recovery, uniaxial stress",), "the same"),
    Point("creep and recovery, ends that do not slip", "slab",
          ("creep and recovery, ends",), "quasi-static scikit-fem, backward Euler extrapolated"),
    Point("decay of the paper's slab", "slab",
          ("slab of the paper: decay to phi",), "phi C phi/2 of the same mesh"),
    Point("the same over mu_D, the paper's", "slab",
          ("slab of the paper: decay over mu_D",), "the paper reads 0.015 from its curves"),
    Point("**Rotation**: strain of a free body over 100 turns", "rotation",
          ("spin of 100 turns: change of strain",), "two million steps, float64"),
    Point("angular momentum, relative change", "rotation",
          ("spin of 100 turns: change of angular",), "the same"),
    Point("patch test: stress", "rotation", ("patch test, 50 random meshes: stress",),
          "50 random meshes, gradients of 10 %"),
    Point("patch test: balance of inner nodes", "rotation",
          ("patch test, 50 random meshes: balance",), "the same"),
    Point("**Waves**: speed in a bar", "waves", ("bar wave, 80",), "sqrt(E/rho), 80 cells a wave"),
    Point("dilatational wave", "waves", ("dilatational wave, 80",), "sqrt((lam + 2 mu)/rho)"),
    Point("order of the dispersion, least", "waves",
          ("bar wave: order", "dilatational wave: order"), "10 to 80 cells a wave"),
    Point("**A ring**: breathing and bending, same mesh", "waves",
          ("ring of 864 elements, breathing: to", "ring of 864 elements, bending: to"),
          "all modes by LAPACK"),
    Point("**A mesh of gmsh with holes**: tip", "waves", ("block with holes: tip, QDEM",),
          "scikit-fem, same mesh"),
    Point("its von Mises stress, greatest difference", "waves",
          ("block with holes: von Mises",), "the same"),
    Point("its first frequency", "waves", ("block with holes: first frequency",), "the same"),
)  # fmt: skip


# --- the page ----------------------------------------------------------------------------------


def page(lines: Sequence[dict[str, Any]]) -> str:
    """The whole page in Markdown; a part that is not recorded leaves "not computed"."""
    parts = {line["part"]: checks_of(line) for line in lines}
    text = FIGURE.sub(lambda match: figure(parts, match), WORDS.read_text(encoding="utf-8"))
    return text.replace("{points}", "\n".join(point_row(parts, point) for point in POINTS)).replace(
        "{parts}", "\n".join(part_row(line) for line in lines)
    )


def checks_named(parts: Parts, part: str, start: str) -> list[Check]:
    """Checks of a part whose names begin so; raises `KeyError` for none."""
    checks = [check for check in parts[part] if check.name.startswith(start)]
    if not checks:
        raise KeyError(f"the record has no check {part}: {start}")
    return checks


def figure(parts: Parts, match: re.Match[str]) -> str:
    """A value in the text."""
    part, start, how, last = match.groups()
    if part not in parts:
        return "(not computed)"
    value = checks_named(parts, part, start)[-1 if last else 0].value
    return format(value, how).replace("%", " %")


def point_row(parts: Parts, point: Point) -> str:
    """A row of the table; of several checks the worst."""
    if point.part not in parts:
        return f"| {point.words} | | not computed | {point.how} |"
    checks = [c for start in point.starts for c in checks_named(parts, point.part, start)]
    shown = worst(checks)
    measured = number(shown) if shown.holds else f"{number(shown)}: **fails**"
    return f"| {point.words} | {bar(shown)} | {measured} | {point.how} |"


def worst(checks: Sequence[Check]) -> Check:
    """One that fails, else the largest of those with a bar; of orders the least."""
    among = (
        [check for check in checks if not check.holds]
        or [check for check in checks if check.bar != "reported"]
        or list(checks)
    )
    best = min if "order" in among[0].name else max
    return best(among, key=lambda check: check.value)


def number(check: Check) -> str:
    """A value: more digits where it is compared with another."""
    digits = 2 if check.bar.startswith("<") else 5
    return f"{check.value:.{digits}g} {check.unit}".rstrip()


def bar(check: Check) -> str:
    """A bar with its unit."""
    value, within, share = check.bar.removeprefix("= ").partition(" within ")
    unit = "" if check.bar == "reported" else check.unit
    return f"{value} {unit}".rstrip() + within + share


def part_row(line: dict[str, Any]) -> str:
    """A part of the record: what holds, what it cost, and which code made it."""
    checks = checks_of(line)
    return (
        f"| {line['part']} | {sum(check.holds for check in checks)} of {len(checks)} | "
        f"{line['cpu_s']:.0f} s | {line['started'][:10]} | `{line['commit'][:10]}` | "
        f"`{line['code']}` |"
    )


def main(words: Sequence[str] | None = None) -> None:
    """Write it."""
    parser = argparse.ArgumentParser(description="Writes the validation of QDEM from its record.")
    parser.add_argument("--record", type=Path, default=RECORD, help="the record's .jsonl")
    parser.add_argument("--out", type=Path, default=PAGE_PATH, help="the page")
    arguments = parser.parse_args(words)
    write_atomically(arguments.out, page(record_lines(arguments.record)))
    print(arguments.out)


if __name__ == "__main__":
    main()
