"""docs/settlement-ensemble.md and its picture, from validation/results/settlement-ensemble.

python -m validation.settlement_ensemble_page
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from adapters.run_folder import write_atomically
from validation.page_text import page_filled
from validation.same_packing_page import table
from validation.settlement_ensemble import KINDS, Kind
from validation.settlement_ensemble_picture import draw
from validation.settlement_ensemble_reading import (
    Cost,
    Figure,
    Nested,
    at_cycle,
    column_at,
    column_mean,
    column_since,
    cost,
    curves,
)
from validation.settlement_ensemble_record import EnsembleRecord, Kept

PAGE = Path(__file__).parents[1] / "docs" / "settlement-ensemble.md"
TEXT = Path(__file__).with_suffix(".md")

Told = Callable[[Nested], str]
"""A cell of a table."""


def number(value: float, digits: int) -> str:
    """A number with ``digits`` decimals, or a dash for one that is not known."""
    return f"{value:,.{digits}f}" if value == value else "-"


def told_mean(factor: float, digits: int) -> Told:
    """Mean with its band over all packings, times ``factor``."""

    def told(found: Nested) -> str:
        mean = number(factor * found.mean, digits)
        return (
            mean if found.half != found.half else f"{mean} ± {number(factor * found.half, digits)}"
        )

    return told


def told_only(attribute: str, factor: float, digits: int) -> Told:
    """One of the figures of `Nested`, times ``factor``."""
    return lambda found: number(factor * getattr(found, attribute), digits)


SINCE = column_since("settlement", 1.0)
LINES: tuple[tuple[str, Figure, Told], ...] = (
    ("settlement since the rain, µm", column_at("settlement"), told_mean(1e6, 0)),
    ("**settlement since kᵢ, µm**", SINCE, told_mean(1e6, 1)),
    ("... these packings, ± µm", SINCE, told_only("half_given", 1e6, 1)),
    ("... spread between packings, µm", SINCE, told_only("between", 1e6, 1)),
    ("... spread within a packing, µm", SINCE, told_only("within", 1e6, 1)),
    ("way of the piston since kᵢ, µm", column_since("piston_height", -1.0), told_mean(1e6, 1)),
    ("coordination number", column_mean("coordination_number"), told_mean(1.0, 3)),
    ("relative density", column_mean("relative_density"), told_mean(1.0, 4)),
    ("elastic deflection, µm", column_mean("elastic_deflection"), told_mean(1e6, 2)),
    ("piston stiffness, N/µm", column_mean("piston_stiffness"), told_mean(1e-6, 2)),
    ("rms force error over the peak, %", column_mean("force_error"), told_mean(1e2, 2)),
    ("runs", column_at("cycle"), lambda found: str(found.members)),
    ("of packings", column_at("cycle"), lambda found: str(found.packings)),
)
"""Lines of the table of a kind: words, figure, how it is told."""


def table_plan() -> str:
    """What is to be computed."""
    rows = []
    for kind in KINDS.values():
        scene = kind.scene(1)
        rows.append(
            [
                f"`{kind.name}`",
                f"{kind.title}; `scenes/{kind.scene_name}.toml`",
                f"{scene.grain_count:,}",
                f"{scene.steps_per_cycle:,}",
                str(kind.packings),
                str(kind.k_i),
                str(kind.packings * kind.members),
                f"{kind.last:,}",
                str(kind.window),
            ]
        )
    head = ["kind", "scene", "grains", "steps a cycle", "packings", "kᵢ", "members", "to cycle"]
    return table([*head, "cycles a window"], rows)


def table_reached(record: EnsembleRecord) -> str:
    """Where every run stands that has begun."""
    rows = []
    for kind in KINDS.values():
        for piece in kind.runs():
            kept = record.kept(piece.name)
            if kept is None:
                continue
            settlement = record.table(piece.name)["settlement"]
            size = (record.path / kept.checkpoint.file).stat().st_size
            what = "packing" if piece.member is None else "member"
            if piece.perturbation:
                what += f", one grain {piece.perturbation:.0e} m aside"
            rows.append(
                [
                    f"`{piece.name}`",
                    what,
                    f"{kept.cycle:,} of {piece.last:,}",
                    number(1e6 * float(settlement[-1]), 1) if len(settlement) else "-",
                    f"{size / 1e3:.0f}",
                    kept.failed.splitlines()[0] if kept.failed else "",
                ]
            )
    head = ["run", "what", "cycles", "settlement since the rain, µm", "checkpoint, kB", "failed"]
    return table(head, rows)


def missing(record: EnsembleRecord) -> str:
    """In words, what the plan lacks."""
    words = []
    for kind in KINDS.values():
        stands = [(piece, record.kept(piece.name)) for piece in kind.runs()]
        packings = sum(
            kept is None or kept.cycle < piece.last for piece, kept in stands if not piece.packing
        )
        members = sum(
            kept is None or kept.cycle < piece.last for piece, kept in stands if piece.packing
        )
        every = kind.packings * kind.members
        parts = (
            (packings, f"{packings} of {kind.packings} packings to cycle {kind.k_i}"),
            (members, f"{members} of {every} members to cycle {kind.last:,}"),
        )
        if packings or members:
            words.append(f"{kind.name}: " + ", ".join(text for count, text in parts if count))
    return "; ".join(words) + "." if words else "nothing."


def table_figures(kind: Kind, record: EnsembleRecord) -> str:
    """Figures of a kind at the cycles it names; lines and columns that have any."""
    runs = curves(kind, record)
    found = {
        cycle: [at_cycle(kind, runs, figure, cycle) for _, figure, _ in LINES]
        for cycle in kind.told
    }
    reached = [cycle for cycle, figures in found.items() if any(figures)]
    if not reached:
        return f"`{kind.name}`: nothing computed yet."
    rows = []
    for line, (words, _, told) in enumerate(LINES):
        cells = [found[cycle][line] for cycle in reached]
        texts = ["-" if cell is None else told(cell) for cell in cells]
        if set(texts) != {"-"}:
            rows.append([words, *texts])
    return table([f"{kind.name}, after cycle", *(f"{cycle:,}" for cycle in reached)], rows)


def table_cost(record: EnsembleRecord) -> str:
    """What each kind has cost and what it still needs."""
    rows = []
    for kind in KINDS.values():
        found: Cost = cost(kind, record)
        rows.append(
            [
                f"`{kind.name}`",
                number(found.rain, 0),
                number(found.cycle, 2),
                f"{found.cycles_done:,} of {found.cycles_planned:,}",
                number(found.spent / 3600, 2),
                number(found.missing / 3600, 1),
            ]
        )
    head = ["kind", "a rain of grains, CPU s", "a load cycle, CPU s", "cycles", "spent, CPU h"]
    return table([*head, "still needed, CPU h"], rows)


def origin(kept: Sequence[Kept]) -> str:
    """Machines, versions and commits that the runs come from."""
    parts = [part for each in kept for part in each.parts]
    machines = "; ".join(dict.fromkeys(part["machine"] for part in parts))
    engines = ", ".join(dict.fromkeys(each.engine for each in kept))
    commits = ", ".join(dict.fromkeys(short(part["commit"]) for part in parts))
    return f"{machines}; {engines}; commits {commits}."


def short(commit: str) -> str:
    """Seven digits of a commit, and whether files differed from it."""
    digits, *modified = commit.split("-")
    return "-".join([digits[:7], *modified])


def page(record: EnsembleRecord) -> str:
    """The page of a record."""
    pieces = [piece for kind in KINDS.values() for piece in kind.runs()]
    kept = [each for piece in pieces if (each := record.kept(piece.name)) is not None]
    sizes = [path.stat().st_size for path in record.path.iterdir()]
    checkpoints = [path.stat().st_size for path in record.path.glob("*.restart.xz")]
    parts = {
        "TABLE_PLAN": table_plan(),
        "TABLE_REACHED": table_reached(record),
        "MISSING": missing(record),
        "FIGURES": "\n\n".join(table_figures(kind, record) for kind in KINDS.values()),
        "TABLE_COST": table_cost(record),
        "SIZE": f"{sum(sizes) / 1e6:.1f} MB",
        "RUNS": str(len(kept)),
        "CHECKPOINT": f"{max(checkpoints) / 1e3:.0f} kB",
        "ORIGIN": origin(kept),
    }
    return page_filled(TEXT.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    record = EnsembleRecord()
    write_atomically(PAGE, page(record))
    draw(record, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
