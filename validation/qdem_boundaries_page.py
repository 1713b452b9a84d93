"""docs/qdem-boundaries.md and its picture from validation/results/qdem-boundaries.jsonl.

    python -m validation.qdem_boundaries_page

The words are in ``qdem_boundaries_page.md`` beside this file; a test holds the page to the record.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from adapters.run_folder import write_atomically
from validation.page_text import page_filled
from validation.parts_record import parts_read
from validation.qdem_boundaries import RECORD
from validation.qdem_boundary_waves import GROUND, oblique_derived

WORDS = Path(__file__).with_suffix(".md")
PAGE = RECORD.parents[2] / "docs" / "qdem-boundaries.md"
PICTURE = PAGE.with_suffix(".png")
Data = dict[str, Any]
ENDS = ("fixed", "free", "dashpots", "depth")


def page(parts: Data) -> str:
    """The whole page in Markdown."""
    rows = {name: part["rows"] for name, part in parts.items()}
    origin = parts["ground"]["origin"]
    return page_filled(
        WORDS.read_text(encoding="utf-8"),
        {
            "machine": origin["machine"],
            "started": origin["started"][:10],
            "cost": _lines(_cost(row) for row in rows["cost"]),
            "step": _lines(
                f"{_end(row['depth'])} | {row['step']:.4f} | {row['lagged']:.3f}"
                for row in rows["step"]
            ),
            "bar": _lines(
                f"{row['wave']} | {'depth of 5 cells' if row['end'] == 'depth' else row['end']} | "
                f"{row['width']:g} | {row['left']:.4g} | {row['left_derived']:.4g} | "
                f"{row['absorbed']:.6f} | {row['absorbed_derived']:.6f}"
                for row in rows["bar"]
            ),
            "lost": f"{100 * max(1 - r['left'] - r['absorbed'] for r in rows['bar']):.1f} %",
            "oblique": _lines(_oblique(rows["oblique"])),
            "ground": _lines(_ground(rows["ground"])),
            "ground_words": _ground_words(rows["ground"]),
        },
    )


def _lines(lines: Any) -> str:
    return "\n".join(f"| {line} |" for line in lines)


def _end(depth: float | None) -> str:
    return "dashpots" if depth is None else f"and springs, depth {depth / 0.1:g} cells"


def _cost(row: Data) -> str:
    step, look = ([1e6 * each for each in row[key]] for key in ("step_s", "look_s"))
    return (
        f"{row['model']} | {step[0]:.0f} µs | {step[1]:.0f} µs | {row['touching'][0]} | "
        f"{row['touching'][1]} | {look[0]:.0f} µs | {look[1]:.0f} µs"
    )


def _oblique(rows: list[Data]) -> list[str]:
    lines = []
    for degrees in sorted({row["degrees"] for row in rows}):
        mine = [row for row in rows if row["degrees"] == degrees]
        found = ", ".join(f"{row['left']:.4f} ({row['cells']})" for row in mine)
        lines.append(f"{degrees} | {mine[0]['derived']:.4f} | {found}")
    return lines


def ground_row(rows: list[Data], load: str, side: float, end: str) -> Data:
    """The row of a load, a block and an end."""
    (found,) = (r for r in rows if (r["load"], r["side"], r["end"]) == (load, side, end))
    return found


def _ground(rows: list[Data]) -> list[str]:
    lines = []
    for load in ("pulse", "lasting"):
        for side in sorted({row["side"] for row in rows if row["end"] == "fixed"}):
            each = [ground_row(rows, load, side, end) for end in ENDS]
            errors = " | ".join(
                f"{100 * row['error'][0]:.3g} %, {100 * row['error'][1]:.3g} %" for row in each
            )
            lines.append(f"{load} | {side:g} m | {errors} | {each[2]['cpu_s']:.2f} s")
    return lines


def _ground_words(rows: list[Data]) -> str:
    half, same, twice = (
        ground_row(rows, "lasting", 1.2, end) for end in ("half depth", "depth", "twice depth")
    )
    alone = ground_row(rows, "lasting", 1.2, "dashpots")
    pulse = [ground_row(rows, "pulse", 1.2, end) for end in ("half depth", "depth", "twice depth")]
    big, small = (ground_row(rows, "pulse", *of) for of in ((3.0, "fixed"), (1.2, "depth")))
    return (
        f"Under the lasting load the block of 1.2 m has settled after 24 ms by {alone['last']:.2f} "
        f"times what the endless ground has on dashpots alone, and goes on; by {half['last']:.2f}, "
        f"{same['last']:.2f} and {twice['last']:.2f} times with a depth of 0.6, 1.2 and 2.4 m.  "
        f"Of the pulse these depths miss {100 * pulse[0]['error'][0]:.0f} %, "
        f"{100 * pulse[1]['error'][0]:.0f} % and {100 * pulse[2]['error'][0]:.0f} %.  For it, "
        f"fixed ends of a block of 3 m, {big['elements'] / small['elements']:.0f} times the "
        f"elements, err by {100 * big['error'][0]:.0f} % under the load where the block of 1.2 m "
        f"with a depth errs by {100 * small['error'][0]:.0f} %."
    )


def picture(parts: Data, path: Path) -> None:
    """Two panels: waves at an angle, error of the ground against its cost."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, 2, figsize=(9.5, 3.6), layout="constrained")
    angles = np.linspace(1, 85, 85)
    poisson = float(np.mean(GROUND.poisson))
    shares = [oblique_derived(np.radians(a), poisson) for a in angles]
    panels[0].semilogy(angles, shares, "-", color="#888888", label="closed form")
    rows = parts["oblique"]["rows"]
    for cells, marker in ((24, "o"), (36, "s"), (48, "^")):
        mine = [r for r in rows if r["cells"] == cells]
        panels[0].semilogy([r["degrees"] for r in mine], [r["left"] for r in mine], marker,
                           color="#2a6f97", mfc="none", label=f"{cells} cells")  # fmt: skip
    panels[0].set(xlabel="degrees from the normal", ylabel="share of a p-wave's energy back",
                  ylim=(1e-5, 1))  # fmt: skip
    rows = parts["ground"]["rows"]
    colours = dict(zip(ENDS, ("#888888", "#c9a227", "#b0413e", "#2a6f97"), strict=True))
    for load, style, marker in (("pulse", "-", "o"), ("lasting", "--", "s")):
        for end in ENDS:
            mine = [r for r in rows if r["load"] == load and r["end"] == end]
            panels[1].loglog([r["elements"] for r in mine], [r["error"][0] for r in mine],
                             marker + style, color=colours[end], ms=4, lw=1,
                             label=f"{end}, {load}")  # fmt: skip
    panels[1].set(xlabel="elements", ylabel="error of the settlement under the load")
    for panel in panels:
        panel.legend(fontsize=6)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


if __name__ == "__main__":
    write_atomically(PAGE, page(parts_read(RECORD)))
    picture(parts_read(RECORD), PICTURE)
