"""Tables and sentences of docs/rigid-indeterminacy.md, from the lines of its record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.rigid_indeterminacy import (
    DAMPED,
    FROM_SPRINGS,
    LIGGGHTS,
    LIMIT,
    LOADINGS,
    ORDER_BAR,
    RELAXATION,
    SCENES,
    SPRINGS,
)

Data = dict[str, Any]


def _of(lines: Sequence[Data], scene: str, method: str) -> list[Data]:
    return [line for line in lines if line["scene"] == scene and line["method"] == method]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def stiff_table(lines: Sequence[Data]) -> str:
    """Errors by stiffness, and of the direct limit against dense least squares."""
    table = [
        "| scene | contacts | redundant | dense | | error at k = 1e2 | 1e4 | 1e6 | 1e8 | 1e10 |",
        "|" + "---|" * 10,
    ]
    for scene in SCENES:
        if scene.mobilised:
            continue
        limit = _of(lines, scene.name, LIMIT)[0]
        for method in (SPRINGS, LIGGGHTS):
            error = {
                line["stiffness"]: line["error"]
                for line in _of(lines, scene.name, method)
                if scene.loads_as_asked(line["ramp"])
            }
            if error:
                cells = [_number(error.get(k)) for k in (1e2, 1e4, 1e6, 1e8, 1e10)]
                table.append(
                    f"| {scene.name} | {limit['contacts']} | {limit['redundant']} | "
                    f"{_number(limit['error'])} | {method} | {' | '.join(cells)} |"
                )
    return "\n".join(table)


def loading_table(lines: Sequence[Data]) -> str:
    """Error at equal stiffness by the steps of loading, where contacts stick."""
    table = [
        f"| scene | | at once | {' | '.join(f'{ramp:,} steps' for ramp in LOADINGS[1:])} |",
        "|" + "---|" * 6,
    ]
    for scene in SCENES:
        for method in (SPRINGS, DAMPED, LIGGGHTS):
            error = {
                line["ramp"]: line["error"]
                for line in _of(lines, scene.name, method)
                if line["stiffness"] == 1e6
            }
            if error and scene.path_matters and not scene.mobilised:
                cells = [_number(error.get(ramp)) for ramp in LOADINGS]
                table.append(f"| {scene.name} | {method} | {' | '.join(cells)} |")
    return "\n".join(table)


def _costs(lines: Sequence[Data], scene: str) -> dict[str, float]:
    """Least cost [s] of each method that comes to an error of 1e-6; the direct limit's own."""
    costs = {LIMIT: _of(lines, scene, LIMIT)[0]["cpu_s"]}
    for method in (RELAXATION, SPRINGS, LIGGGHTS):
        reached = [line["cpu_s"] for line in _of(lines, scene, method) if line["error"] <= 1e-6]
        if reached:
            costs[method] = min(reached)
    return costs


def springs_words(lines: Sequence[Data]) -> str:
    """Where the springs are the cheapest, where they do not come so far, and how far they do."""
    names = [scene.name for scene in SCENES if not scene.mobilised]
    costs = {name: _costs(lines, name) for name in names}
    first = [name for name in names if min(costs[name], key=costs[name].__getitem__) == SPRINGS]
    never = [name for name in names if SPRINGS not in costs[name]]
    least = [min(line["error"] for line in _of(lines, name, SPRINGS)) for name in names]
    words = (
        "Our own springs, a compiled loop that starts from the touching grains, are the cheapest "
        f"on {len(first)} of {len(names)} scenes"
    )
    words += f" and do not come so far on: {', '.join(never)}" if never else ""
    return f"{words}.  Their least errors are {min(least):.0e} to {max(least):.0e}."


def cost_table(lines: Sequence[Data]) -> str:
    """Least costs to an error of 1e-6."""
    table = ["| scene | direct limit | relaxation | springs | LIGGGHTS |", "|" + "---|" * 5]
    for scene in SCENES:
        if scene.mobilised:
            continue
        costs = _costs(lines, scene.name)
        cells = [
            f"{1e3 * costs[method]:.2g}" if method in costs else "-"
            for method in (LIMIT, RELAXATION, SPRINGS, LIGGGHTS)
        ]
        table.append(f"| {scene.name} | {' | '.join(cells)} |")
    return "\n".join(table)


def sliding_table(lines: Sequence[Data]) -> str:
    """Where contacts slide: errors by the steps of loading, and other states."""
    table = [
        "| scene | sliding | loaded in steps | springs | LIGGGHTS | residual of the springs | "
        "other state | springs from it |",
        "|" + "---|" * 8,
    ]
    for scene in SCENES:
        if not scene.mobilised:
            continue
        other = {line["ramp"]: line for line in _of(lines, scene.name, FROM_SPRINGS)}
        peer = {line["ramp"]: line["error"] for line in _of(lines, scene.name, LIGGGHTS)}
        for line in _of(lines, scene.name, SPRINGS):
            ramp = line["ramp"]
            state = other.get(ramp)
            table.append(
                f"| {scene.name} | {line['sliding']} of {line['contacts']} | {ramp or 'at once'} | "
                f"{_number(line['error'])} | {_number(peer.get(ramp))} | "
                f"{_number(line['residual'])} | {_number(state['error'] if state else None)} | "
                f"{_number(state['tolerance'] if state else None)} |"
            )
    return "\n".join(table)


def order_table(lines: Sequence[Data]) -> str:
    """What another order, other numbers and another start do."""
    table = ["| pile | contacts | sliding | other order | and other start |", "|" + "---|" * 5]
    for line in lines:
        if line["method"] == "order":
            cells = [_number(line[name]) for name in ("order", "start")]
            shown = cells if line["found"] else ["not found", "-"]
            table.append(
                f"| {line['scene']} | {line['contacts']} | {line['sliding']} | "
                f"{' | '.join(shown)} |"
            )
    return "\n".join(table)


def found_words(lines: Sequence[Data]) -> str:
    """For which piles the limit was found, and what order and start did to it."""
    piles = [line for line in lines if line["method"] == "order"]
    found = [line for line in piles if line["found"]]
    lost = [line["scene"] for line in piles if not line["found"]]
    astray = [line["scene"] for line in found if line["start"] > ORDER_BAR]
    other = {
        line["scene"]: line["error"]
        for line in lines
        if line["method"] == FROM_SPRINGS and line["error"] > ORDER_BAR
    }
    words = (
        f"The limit is found on {len(found)} of {len(piles)} piles; there another order changes "
        f"forces by {max(line['order'] for line in found):.1e} at most, another start by "
        f"{max(line['start'] for line in found):.1e}"
    )
    words += f", which is another state on: {', '.join(astray)}." if astray else "."
    if other:
        told = ", ".join(f"{scene} ({error:.1e} of the weight)" for scene, error in other.items())
        words += (
            "  That is no proof that there is one state: relaxed from where the springs rest "
            f"(table above), it ends in another on: {told}."
        )
    if lost:
        words += (
            f"  Not found, so `trackbed validate rigid-indeterminacy` fails there: "
            f"{', '.join(lost)}."
        )
    return words


def wear_table(lines: Sequence[Data]) -> str:
    """Measures of wear and breakage."""
    table = ["| what | measured | bar |", "|---|---|---|"]
    for line in lines:
        if line["method"] == "wear":
            unit = f" {line['unit']}" if line["unit"] else ""
            table.append(f"| {line['name']} | {line['value']:.2g}{unit} | {line['bar']:g}{unit} |")
    return "\n".join(table)
