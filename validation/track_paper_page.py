"""The page on the paper's track, written from its record.

python -m validation.track_paper scenes/track.toml    the record, from the prepared bed
python -m validation.track_half RUN                         that of half a sleeper
python -m validation.track_paper_page                       writes the page
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from validation.page_text import page_filled, table
from validation.track_half import RECORD as HALF
from validation.track_half import half_text
from validation.track_paper import RECORD
from validation.track_periodic import LIMIT
from validation.track_periodic import RECORD as REPEATED
from validation.track_split import RECORD as SPLIT

WORDS = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "qdem-track-paper.md"
CAR = 0.625
"""From one car to the next at the paper's speed [s]: front axles at 0.11, 0.73, ... s (Fig. 7)."""
PAPER_RATE, PAPER_ELEMENTS, PAPER_STEP = 56.5e6, 622_591 + 284_241, 1e-7
"""Element-steps a second of one card, from the paper's beam: 488,361 elements, 2e7 steps, 2 days;
elements and step [s] of its track."""
LINK = 10e9
"""Bytes a second that a link between processes is taken to carry."""


def page(
    record: dict[str, Any], repeated: dict[str, Any], lying: dict[str, Any], half: dict[str, Any]
) -> str:
    """The page for the record, and those of a bed that repeats, a split one, half a sleeper."""
    marches = list(record["marches"].values())
    one = marches[0]
    elements = record["elements_ballast"] + record["elements_sleeper"]
    return page_filled(WORDS.read_text(encoding="utf-8"), {
        "command": f"`{record['command']}`", "machine": record["machine"],
        "date": record["started"][:10], "cells": " x ".join(map(str, record["cells"])),
        "grains": f"{record['grains']:,}", "ballast": f"{record['elements_ballast']:,}",
        "sleeper": f"{record['elements_sleeper']:,}", "nodes": f"{record['nodes']:,}",
        "step": f"{1e6 * one['step']:.3f}", "step_any": f"{1e6 * record['step_any']:.3f}",
        "prepared": prepared(record),
        **lying_words(record), **axle_words(record),
        "threads": " | ".join(threads(m["threads"]) for m in marches),
        "rule": "|".join(["---"] * len(marches)), "steps": steps(marches),
        "limit": str(LIMIT), "loose": f"{repeated['one by one']['hard']['loose']:.2f}",
        "periodic_command": repeated["command"], "periodic": periodic(repeated),
        "lying": str(lying["grains"]), "split_command": lying["command"],
        "met": f"{lying['split'][0]['vertices']} vertices", "passage": passage(one, elements),
        "split": table([], split(record["split"])).split("\n", 2)[2],
        "judged": judged(record["split"], one),
        "half_command": half["command"], "half_date": half["started"][:10],
        "half": half_text(half),
    })  # fmt: skip


def threads(count: int) -> str:
    """One thread, two threads."""
    return "one thread" if count == 1 else f"{count} threads"


def prepared(record: dict[str, Any]) -> str:
    """What each stage of the bed took, and how near to equilibrium it left it."""
    rows = [
        [f"`{stage}`", f"{rest['time']:.3g}", f"{1e6 * rest['step']:.3g}", f"{rest['steps']:,}",
         f"{rest['cpu_s'] / 60:.0f}", f"{rest['unbalanced']:.3f}", f"{rest['kinetic']:.1e}",
         f"{rest['loose']:.4f}"]
        for stage, rest in record["rests"].items()
    ]  # fmt: skip
    head = ["stage", "simulated [s]", "step [µs]", "steps", "processor time [min]",
            "unbalanced", "kinetic", "loose"]  # fmt: skip
    total = sum(rest["cpu_s"] for rest in record["rests"].values())
    (stand,) = record["stands"].values()
    return table(head, rows) + (
        f"\n\nIn all {total / 3600:.1f} h of a processor, and {record['grains_cpu_s']:.0f} s for "
        f"the grains.  Let go for {1e3 * stand['time']:g} ms without a load, its sliders take "
        f"{stand['slid'] / stand['elastic']:.1e} of the energy of its springs, the sleeper sinks "
        f"by {1e6 * stand['sinking']:.2g} µm, and {100 * stand['at_limit']:.0f} % of the pairs "
        "that touch are at Coulomb's limit."
    )


def lying_words(record: dict[str, Any]) -> dict[str, str]:
    """How the ballast lies, and what touches."""
    shape, contacts = record["shape"], record["contacts"]
    return {
        "foot": f"{shape['foot']:.2f}", "top": f"{shape['top']:.2f}",
        "height": f"{shape['height']:.2f}", "below": f"{shape['below_sleeper']:.2f}",
        "touching": f"{contacts['touching']:,}", "listed": f"{contacts['listed']:,}",
        "vertices": f"{record['vertices']:,}",
        "coordination": f"{contacts['coordination']:.1f}",
        "solid": f"{shape['solid']:.2f}", "alone": f"{shape['alone']}",
        "on_it": f"{shape['alone_on_sleeper']}",
        "deepest": f"{1e6 * contacts['deepest']:.2g}",
    }  # fmt: skip


def axle_words(record: dict[str, Any]) -> dict[str, str]:
    """What a search for pairs costs, and how often one was due under an axle."""
    axle, one = record["axle"], next(iter(record["marches"].values()))
    search = one["parts"]["a search for pairs"] / one["seconds_a_step"]
    return {
        "axle_force": f"{axle['force'] / 1e3:g}", "axle_steps": f"{axle['steps']:,}",
        "axle_searches": {0: "none", 1: "one"}.get(axle["searches"], str(axle["searches"])),
        "axle_speed": f"{1e3 * axle['speed']:.2g}", "search_steps": f"{search:.1f}",
        "search_due": f"{search / 0.3:.0f}",
        "search_share": f"{100 * search * axle['searches'] / axle['steps']:.2g}",
    }  # fmt: skip


def periodic(repeated: dict[str, Any]) -> str:
    """Rows of how a bed that repeats comes to rest."""
    ways = repeated["one by one"], repeated["all together"]
    rows = []
    for stage in ("hard", "rest"):
        found = [way.get(stage) for way in ways]
        told = [
            "not begun" if f is None else "at rest" if f["reached"] else "no rest" for f in found
        ]
        rows.append([f"stage `{stage}`", *told])
        for name, unit in (("time", " s"), ("unbalanced", ""), ("loose", ""), ("cpu_s", " s")):
            cells = ["" if f is None else f"{f[name]:.3g}{unit}" for f in found]
            rows.append([{"time": "simulated", "cpu_s": "processor time"}.get(name, name), *cells])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def steps(marches: list[dict[str, Any]]) -> str:
    """Rows of what a step costs, a column a march."""
    rows = [
        ("processor time of a step", [f"{1e3 * m['seconds_a_step']:.1f} ms" for m in marches]),
        ("wall time of it", [f"{1e3 * m['wall_a_step']:.1f} ms" for m in marches]),
        ("million element-steps a processor second", [f"{m['mels']:.1f}" for m in marches]),
        ("million element-steps a second of wall", [f"{m['mels_wall']:.1f}" for m in marches]),
        ("of it elements and motion", [part(m, "elements and motion") for m in marches]),
        ("contact", [part(m, "contact") for m in marches]),
        ("a search for pairs, when one is due", [part(m, "a search for pairs") for m in marches]),
        ("searches, of steps", [f"{m['searches']} of {m['steps']:,}" for m in marches]),
        ("memory, resident", [f"{m['resident'] / 1e9:.2f} GB" for m in marches]),
        ("processor time to build it", [f"{m['built_cpu_s']:.0f} s" for m in marches]),
    ]  # fmt: skip
    return "\n".join("| " + " | ".join([name, *cells]) + " |" for name, cells in rows)


def part(march: dict[str, Any], name: str) -> str:
    """A part of a step."""
    return f"{1e3 * march['parts'][name]:.1f} ms"


def passage(one: dict[str, Any], elements: int) -> str:
    """What a car costs, beside the paper."""
    count = CAR / one["step"]
    ours = count * elements
    theirs = CAR / PAPER_STEP * PAPER_ELEMENTS
    hours = ours / one["mels"] / 1e6 / 3600
    return (
        f"One car passes in {CAR} s: {count / 1e6:.2f} million steps of {elements:,} elements, "
        f"{ours:.2e} element-steps, **{hours:.0f} h** of one thread.  The paper's {theirs:.2e} "
        f"take {theirs / PAPER_RATE / 3600:.0f} h of one of its cards at the "
        f"{PAPER_RATE / 1e6:.1f} million a second of its beam (488,361 elements, 2e7 steps, two "
        "days, no contact); what its track took, it does not say.  Half an hour would ask for "
        f"{ours / 1800 / 1e6:,.0f} million a second.  No GPU was at hand."
    )


def split(counts: list[dict[str, Any]]) -> list[list[str]]:
    """Rows of the counts."""
    names = {"x": "the sleeper (5 m)", "y": "the track (0.6 m, periodic)"}
    return [
        [names[c["axis"]], str(c["parts"]), f"{c['vertices']:,}", f"{c['shared']:,}",
         f"{c['bytes'] / 1e3:,.0f} kB", f"{c['busiest']:.2f}"]
        for c in counts
    ]  # fmt: skip


def judged(counts: list[dict[str, Any]], one: dict[str, Any]) -> str:
    """What the bytes mean beside a step."""
    best = max((c for c in counts if c["axis"] == "x"), key=lambda c: c["parts"])
    other = max((c for c in counts if c["axis"] == "y"), key=lambda c: c["parts"])
    share = best["busiest"] * one["seconds_a_step"] / best["parts"]
    told = best["bytes"] / LINK
    return (
        f"Along the sleeper, {best['parts']} processes: {1e6 * told:.0f} µs a step at "
        f"{LINK / 1e9:g} GB/s, beside {1e3 * share:.1f} ms of computing on such cores: "
        f"{100 * told / share:.2f} %.  Along the track it is "
        f"{other['bytes'] / best['bytes']:.1f} times as much.  On cards a step of such a part "
        "takes some tenths of a millisecond, and a message begins in some microseconds: there, "
        "what is inside has to be computed while the rim is told.  In slabs along the sleeper a "
        "process has two neighbours at most, whatever their number."
    )


def records() -> list[dict[str, Any]]:
    """The committed records that `page` takes."""
    paths = (RECORD, REPEATED, SPLIT, HALF)
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths]


if __name__ == "__main__":
    PAGE.write_text(page(*records()), encoding="utf-8")
