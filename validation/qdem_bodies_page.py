"""docs/qdem-bodies.md and its picture from validation/results/qdem-bodies.jsonl.

    python -m validation.qdem_bodies_page

The words are in ``qdem_bodies_page.md`` beside this file; a test holds the page to the record.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from adapters.run_folder import write_atomically
from validation.advise_track import RECORD as TRACK
from validation.parts_record import parts_read
from validation.qdem_bodies import RECORD

WORDS = Path(__file__).with_suffix(".md")
PAGE = RECORD.parents[2] / "docs" / "qdem-bodies.md"
PICTURE = PAGE.with_suffix(".png")
Data = dict[str, Any]


def page(parts: Data, track: Data) -> str:
    """The whole page in Markdown, from its record and that of the small track."""
    rows = {name: part["rows"] for name, part in parts.items()}
    grains = [row for row in rows["inertia"] if row["body"].startswith("grain")]
    over = [row["predicted"] / row["measured"] for row in rows["advise"]]
    least, most = min(r["least"] for r in grains), max(r["greatest"] for r in grains)
    return WORDS.read_text(encoding="utf-8").format(
        machine=parts["cost"]["origin"]["machine"],
        started=parts["cost"]["origin"]["started"][:10],
        top=_table(
            f"{1e6 * r['step']:g} µs | {r['error']:.1e} | {r['energy']:.1e}" for r in rows["top"]
        ),
        stiffness=_table(
            f"{r['cells']} x {r['cells']} x {r['cells']} | {r['young'] / 1e9:g} GPa | "
            f"{100 * r['lumped']:.2f}% | {100 * r['solid']:.1f}%"
            for r in rows["stiffness"]
        ),
        order=", ".join(f"{order(rows['stiffness'], n):.2f} ({n} cells)" for n in (2, 3)),
        inertia=_table(
            f"{r['body']} | {r['elements']} | {100 * r['least']:.0f}% to {100 * r['greatest']:.0f}%"
            for r in rows["inertia"]
        ),
        grains=f"{100 * least:.0f}% to {100 * most:.0f}%",
        advise=_table(
            f"{r['young'] / 1e9:g} GPa | {r['predicted']:.2g} | {r['measured']:.2g} | "
            f"{r['predicted'] / r['measured']:.1f}"
            for r in rows["advise"]
        ),
        over=f"{min(over):.1f} to {max(over):.1f}",
        paper=f"{parts['advise']['paper']:.1f}",
        cost=_table(
            f"{r['contact']} | {1e6 * r['deformable_s']:.0f} µs | {1e6 * r['rigid_s']:.0f} µs | "
            f"{r['deformable_s'] / r['rigid_s']:.1f}"
            for r in rows["cost"]
        ),
        **track_words(track),
    )


def track_read() -> Data:
    """The record of the small track."""
    record: Data = json.loads(TRACK.read_text(encoding="utf-8"))
    return record


def track_words(record: Data) -> dict[str, str]:
    """What was advised of a track, and what two runs of it said."""
    probes, (soft, hard) = record["check"]["probes"], record["check"]["cost"]
    least, most = (f"{100 * record[f'error_{name}']:.0f}" for name in ("least", "greatest"))
    return {
        "track_command": record["command"], "track_machine": record["machine"],
        "track_started": record["started"][:10], "track_grains": str(record["grains"]),
        "track_duration": f"{record['duration']:g}",
        "track_rigid": str(record["rigid"] or "none"), "track_errors": f"{least} to {most} %",
        "track_names": " | ".join(probes), "track_rule": "---|" * (len(probes) - 1),
        "track_values": " | ".join(f"{one:.2f}" for one in probes.values()),
        "track_cost": f"{soft:.0f} s deformable, {hard:.0f} s rigid",
    }  # fmt: skip


def order(rows: list[Data], cells: int) -> float:
    """Exponent of 1/E in the error, by least squares between 1 and 100 GPa."""
    chosen = [r for r in rows if r["cells"] == cells and 1e9 <= r["young"] <= 100e9]
    young, error = ([np.log(r[key]) for r in chosen] for key in ("young", "lumped"))
    return -float(np.polyfit(young, error, 1)[0])


def _table(lines: Any) -> str:
    return "\n".join(f"| {line} |" for line in lines)


def picture(parts: Data, path: Path) -> None:
    """Three panels: the limit of stiffness, what is predicted of it, the time step."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, 3, figsize=(10.5, 3.4), layout="constrained")
    for cells, marker in ((2, "o"), (3, "s")):
        rows = [r for r in parts["stiffness"]["rows"] if r["cells"] == cells]
        young = [r["young"] for r in rows]
        for kind, colour in (("lumped", "#2a6f97"), ("solid", "#b0413e")):
            error, fill = [r[kind] for r in rows], "none" if cells == 3 else colour
            panels[0].loglog(young, error, marker + "-", color=colour, mfc=fill, ms=4, lw=1,
                             label=f"{kind} inertia, {cells} cells")  # fmt: skip
    panels[0].loglog([1e9, 1e11], [0.05, 0.0005], ":", color="#888888", label="1/E")
    panels[0].set(xlabel="Young's modulus (Pa)", ylabel="deformable less rigid, over the motion")
    rows = parts["advise"]["rows"]
    young = [r["young"] for r in rows]
    panels[1].loglog(
        young, [r["predicted"] for r in rows], "v-", color="#888888", label="predicted"
    )
    panels[1].loglog(young, [r["measured"] for r in rows], "o-", color="#2a6f97", label="measured")
    panels[1].set(xlabel="Young's modulus of the stones (Pa)", ylabel="error")
    rows = parts["top"]["rows"]
    steps = [r["step"] for r in rows]
    panels[2].loglog(steps, [r["error"] for r in rows], "o-", color="#2a6f97", label="motion")
    panels[2].loglog(steps, [r["energy"] for r in rows], "s-", color="#b0413e", label="energy")
    panels[2].loglog([1e-5, 1e-3], [1e-6, 1e-2], ":", color="#888888", label="dt²")
    panels[2].set(xlabel="time step (s)", ylabel="error of a free spin, 0.2 s")
    for panel in panels:
        panel.legend(fontsize=7)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


if __name__ == "__main__":
    write_atomically(PAGE, page(parts_read(RECORD), track_read()))
    picture(parts_read(RECORD), PICTURE)
