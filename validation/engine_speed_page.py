"""Make ``docs/engine-speed.md`` and its picture: ``python -m validation.engine_speed_page``.

The page is ``engine_speed_page.md`` beside this file, with the tables of the record put in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from validation.engine_speed_accuracy import ERRORS, STEPS, steps_of_scene
from validation.engine_speed_bed import bed_scene
from validation.engine_speed_runs import Row, record_read

TEMPLATE = Path(__file__).with_name("engine_speed_page.md")
PAGE = Path(__file__).parents[1] / "docs" / "engine-speed.md"
PICTURE = PAGE.with_suffix(".png")

NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
PAPER_STEPS = 37200
"""Steps of a load cycle at the paper's stiffness."""
PROCESSES = 128
"""Of the job that the page estimates."""


def of_kind(rows: Iterable[Row], kind: str) -> list[Row]:
    """Rows of one kind that ran to their end."""
    return [row for row in rows if row["kind"] == kind and row["ok"]]


def medians(
    rows: Iterable[Row], keys: Sequence[str], value: Callable[[Row], float]
) -> dict[tuple[Any, ...], tuple[float, float, float, int]]:
    """Median, least, greatest and number of a value, by engine and ``keys`` of the setting."""
    groups: dict[tuple[Any, ...], list[float]] = {}
    for row in rows:
        group = (row["method"], *(row["setting"][key] for key in keys))
        groups.setdefault(group, []).append(value(row))
    return {g: (median(v), min(v), max(v), len(v)) for g, v in groups.items()}


def speed(row: Row) -> float:
    """Grain-steps a CPU second."""
    return float(row["work"] / row["cost_s"])


def speeds(rows: Iterable[Row]) -> dict[tuple[Any, ...], tuple[float, float, float, int]]:
    """`speed` by engine and number of grains."""
    return medians(of_kind(rows, "speed"), ["grains"], speed)


def table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *lines])


def speed_table(rows: Sequence[Row]) -> str:
    """Speeds of the engines on the settled bed."""
    found = speeds(rows)
    grains = sorted({key[1] for key in found})
    start_up = medians(of_kind(rows, "speed"), ["grains"], lambda row: row["start_up_s"])
    contacts = medians(of_kind(rows, "speed"), ["grains"], lambda row: row["contacts_per_grain"])
    lines = []
    for engine in NAMES:
        for count in grains:
            if (engine, count) not in found:
                continue
            middle, least, most, runs = found[engine, count]
            lines.append(
                [
                    NAMES[engine],
                    f"{count:,}",
                    f"{middle / 1e6:.2f} ({least / 1e6:.2f} to {most / 1e6:.2f})",
                    f"{middle / found['lammps', count][0]:.2f}",
                    f"{1e6 * count / middle:,.0f}",
                    f"{start_up[engine, count][0]:.2f}",
                    f"{contacts[engine, count][0]:.3f}",
                    str(runs),
                ]
            )
    head = [
        "engine", "grains", "10⁶ grain-steps a CPU second", "LAMMPS = 1", "µs a step",
        "start-up, s", "contacts a grain at the end", "runs",
    ]  # fmt: skip
    return table(head, lines)


def share_at_paper(alone: float, through: float, steps: int) -> float:
    """Part of the bare engine's speed that is left in a cycle of `PAPER_STEPS`.

    From times [s] of cycles of ``steps``.
    A frame costs the same whatever the steps between two.
    """
    paper = alone * PAPER_STEPS / steps
    return paper / (paper + max(through - alone, 0.0))


def adapter_table(rows: Sequence[Row]) -> str:
    """What trackbed adds to each engine."""
    chosen, keys = of_kind(rows, "adapter"), ["young", "cycles"]
    alone = medians(chosen, keys, lambda row: row["alone_s"])
    through = medians(chosen, keys, lambda row: row["cost_s"])
    python = medians(chosen, keys, lambda row: row["python_s"])
    within = medians(
        [row for row in chosen if row.get("output_s") is not None], keys,
        lambda row: 1.0 - (row["python_s"] + row["output_s"]) / row["cost_s"],
    )  # fmt: skip
    pairs = medians(chosen, keys, lambda row: row["alone_s"] / row["cost_s"])
    steps = medians(chosen, keys, lambda row: row["steps_per_cycle"])
    lines = []
    for group in sorted(alone, key=lambda group: (group[1], list(NAMES).index(group[0]))):
        times = (alone[group][0], through[group][0])
        lines.append(
            [
                NAMES[group[0]],
                f"{group[2]} of {steps[group][0]:,}",
                f"{times[0]:.2f}",
                f"{times[1]:.2f}",
                f"{python[group][0]:.2f}",
                f"**{times[0] / times[1]:.3f}**",
                f"{pairs[group][1]:.3f} to {pairs[group][2]:.3f}",
                f"{share_at_paper(*times, int(steps[group][0])):.3f}",
                f"**{within[group][0]:.3f}**" if group in within else "-",
                str(alone[group][3]),
            ]
        )
    head = [
        "engine", "cycles, of steps", "alone, CPU s", "through trackbed, CPU s", "of it Python, s",
        "alone / through", "single pairs", f"follows for {PAPER_STEPS:,} steps a cycle",
        "timed within one run", "runs",
    ]  # fmt: skip
    return table(head, lines)


def accuracy_table(rows: Sequence[Row]) -> str:
    """Errors of Chung and Ooi's tests at each step, and what a contact costs."""
    found, grains = speeds(rows), min(key[1] for key in speeds(rows))
    lines = []
    for row in of_kind(rows, "accuracy"):
        engine, steps = row["method"], row["setting"]["steps_in_contact"]
        cost = 1e6 * steps / found[engine, grains][0]
        cells = [f"{100 * row['error'][name]:.2g} %" for name in ERRORS]
        lines.append([NAMES[engine], str(steps), f"{cost:.3g}", *cells])
    head = ["engine", "steps in a contact", "CPU µs a grain and contact", *ERRORS]
    return table(head, lines)


def ranks_table(rows: Sequence[Row]) -> str:
    """One and two processes: how the bed is shared, what they exchange, elapsed and CPU time."""
    chosen = of_kind(rows, "ranks")
    keys = ["grains", "ranks"]
    pairs = medians(chosen, keys, lambda row: row["fullest"]["neighs"])
    local = medians(chosen, keys, lambda row: row["fullest"]["nlocal"])
    ghosts = medians(chosen, keys, lambda row: row["fullest"]["nghost"])
    elapsed = medians(chosen, keys, loop_wall)
    cpu = medians(chosen, keys, lambda row: row["cost_s"])
    share = medians(chosen, keys, communication)
    load = medians(chosen, keys, lambda row: row["load_average"])
    lines = []
    for engine, grains, ranks in sorted(pairs, key=lambda key: (list(NAMES).index(key[0]), key)):
        group, one = (engine, grains, ranks), (engine, grains, 1)
        lines.append(
            [
                NAMES[engine],
                f"{grains:,}",
                str(ranks),
                f"{local[group][0]:,.0f}",
                f"{ghosts[group][0]:,.0f}",
                f"{pairs[one][0] / pairs[group][0]:.3f}",
                f"{elapsed[group][0]:.2f} ({elapsed[group][1]:.2f} to {elapsed[group][2]:.2f})",
                f"{elapsed[one][0] / elapsed[group][0]:.2f}",
                f"{cpu[group][0]:.2f}",
                f"{100 * share[group][0]:.0f} %",
                f"{load[group][1]:.0f} to {load[group][2]:.0f}",
                str(elapsed[group][3]),
            ]
        )
    head = [
        "engine", "grains", "processes", "grains of the fullest", "copies it holds",
        "pairs of one process over its", "steps, elapsed s", "speed-up seen", "all, CPU s",
        "communication and waiting", "other work (load)", "runs",
    ]  # fmt: skip
    return table(head, lines)


def loop_wall(row: Row) -> float:
    """Elapsed time of the time steps, from the engine's own parts, mean of the processes [s]."""
    return sum(mean_of(numbers) for numbers in row["parts_s"].values())


def mean_of(numbers: Sequence[float]) -> float:
    """LAMMPS tells least, mean, greatest of the processes; LIGGGHTS the mean alone."""
    return numbers[1] if len(numbers) == 3 else numbers[0]


def communication(row: Row) -> float:
    """Share of the elapsed time in which processes exchange grains or wait for one another."""
    return mean_of(row["parts_s"]["comm"]) / loop_wall(row)


def paper_table(rows: Sequence[Row]) -> str:
    """LAMMPS at the paper's size and stiffness."""
    (row,) = of_kind(rows, "paper")
    lines = [[name, value] for name, value in row["figures"].items()]
    return table(["the paper's bed on LAMMPS", ""], lines)


def page(rows: Sequence[Row]) -> str:
    """The page, with every mark ``{{name}}`` of the template replaced."""
    text = TEMPLATE.read_text(encoding="utf-8")
    parts = {
        "speed": speed_table,
        "adapter": adapter_table,
        "accuracy": accuracy_table,
        "ranks": ranks_table,
        "paper": paper_table,
    }
    for name, make in parts.items():
        text = text.replace("{{" + name + "}}", make(rows))
    for name, words in told(rows).items():
        text = text.replace("{{" + name + "}}", words)
    return text


def told(rows: Sequence[Row]) -> dict[str, str]:
    """Numbers within the page's sentences."""
    scene = bed_scene("lammps", (1, 1))
    few, many = steps_of_scene(scene)
    found = {key: value[0] for key, value in speeds(rows).items()}
    few_grains, many_grains = (choose(key[1] for key in found) for choose in (min, max))
    fastest = found["liggghts", many_grains]
    copies = [
        row["fullest"]["nghost"] / row["fullest"]["nlocal"]
        for row in of_kind(rows, "ranks")
        if row["setting"]["ranks"] == 2
    ]
    limits = [
        row["error"]["sliding limit"]
        for row in of_kind(rows, "accuracy")
        if row["setting"]["steps_in_contact"] == max(STEPS)
    ]
    return {
        "faster": f"{found['liggghts', few_grains] / found['lammps', few_grains]:.1f} times",
        "fastest": f"{found['liggghts', few_grains] / found['yade', few_grains]:.1f} times",
        "limit": f"{100 * min(limits):.1f} to {100 * max(limits):.1f} %",
        "step": f"{scene.time_step:.3g} s",
        "band": f"{few:.0f} and {many:.0f}",
        "ghosts": f"{100 * min(copies):.0f} to {100 * max(copies):.0f} % as many",
        "cycle_minutes": f"{PAPER_STEPS * 1e6 / fastest / PROCESSES / 60:.1f}",
        "rain_hours": f"{2e12 / fastest / PROCESSES / 3600:.1f}",
    }


def main() -> None:
    """Write page and picture from the record."""
    from validation.engine_speed_picture import draw

    rows = record_read()
    PAGE.write_text(page(rows), encoding="utf-8")
    draw(rows, PICTURE)


if __name__ == "__main__":
    main()
