"""docs/ballast-grains.md and its pictures from validation/results/qdem-grains.jsonl.

    python -m validation.qdem_grains_page

The words are in ``qdem_grains_page.md`` beside this file; a test holds the page to the record.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from adapters.run_folder import write_atomically
from validation.qdem_grains import (
    PAPER_GRAINS,
    PAPER_LAYER,
    PAPER_NODES,
    PAPER_TETRAHEDRA,
    ROOT,
    record_read,
)
from validation.qdem_grains_picture import grains_picture, train_picture

WORDS = Path(__file__).with_suffix(".md")
PAGE = ROOT / "docs" / "ballast-grains.md"
Data = dict[str, Any]
FILL = 0.6
"""Solid share of a ballast layer that the words compare with."""
EXACT = {
    "sphere": ("1", "1", "not tested"),
    "cube": ("(pi/6)^(1/3) = 0.8060", "0", "2"),
    "tetrahedron": ("(pi/(6 sqrt 3))^(1/3) = 0.6711", "0", "2 sqrt 2/sqrt 2 = 2"),
}


def page(parts: Data) -> str:
    """The whole page in Markdown."""
    return WORDS.read_text(encoding="utf-8").format(
        **_set_values(parts["set"], parts["steps"]),
        **_shape_values(parts),
        **_cost_values(parts["stiffness"]["rows"], parts["scan"]),
        **_sleeper_values(parts["sleeper"]),
        **_load_values(parts["load"]),
        origin="\n".join(
            f"| {name} | {part['part_cpu_s']:.1f} s | `{part['origin']['commit'][:10]}` | "
            f"{part['origin']['started'][:10]} |"
            for name, part in parts.items()
        ),
    )


def joined(values: Any, form: str) -> str:
    """Numbers in one format, by commas."""
    return ", ".join(format(value, form) for value in values)


def _set_values(part: Data, steps: Data) -> Data:
    rows = zip(part["sieves"], part["asked"], part["got"], part["least"], part["most"], strict=True)
    return {
        "grains": part["grains"], "volume_error": part["volume_error"],
        "paper_elements": PAPER_TETRAHEDRA / PAPER_GRAINS,
        "paper_nodes": PAPER_NODES / PAPER_GRAINS,
        "set_cpu": part["cpu_s"], "per_grain": 1e3 * part["cpu_s"] / part["grains"],
        "tetrahedra": part["tetrahedra"], "nodes": part["nodes"],
        "paper_tetrahedra": PAPER_TETRAHEDRA, "paper_total_nodes": PAPER_NODES,
        "bytes": part["bytes"] / 1e6, "ratios": joined(part["radius_ratio"], ".2f"),
        "step_grains": steps["grains"],
        "steps": joined((1e6 * s for s in steps["step"]), ".2f"),
        "steps_viscous": joined((1e6 * s for s in steps["viscous"]), ".2f"),
        "steps_5": joined((1e6 * s for s in steps["step_at_5_cm"]), ".2f"),
        "mean_volume": 1e6 * part["mean_volume"], "mean_size": 1e3 * part["mean_size"],
        "mean_size_mass": 1e3 * part["mean_size_by_mass"], "between": part["between"],
        "grading": "\n".join(
            f"| {1e3 * size:g} mm | {asked:.1%} | {got:.1%} | {least:.0%} to {most:.0%} |"
            for size, asked, got, least, most in rows
        ),
        "wanted_volume": 1e6 * FILL * PAPER_LAYER / part["grains"],
        "layer": PAPER_LAYER, "share": part["mean_volume"] * part["grains"] / PAPER_LAYER,
        "paper_volume": 1e6 * part["paper_size_volume"],
        "paper_share": part["paper_size_volume"] * part["grains"] / PAPER_LAYER,
    }  # fmt: skip


def _shape_values(parts: Data) -> Data:
    shapes = []
    for name, (psi, roundness, sieve) in EXACT.items():
        part = parts["shapes"][name]
        rounds = joined((level[2] for level in part["levels"][2:]), ".3f")
        finest = part["levels"][-1][1]
        shapes.append(
            f"| {name} | {finest:.4f} | {psi} | {rounds} | {roundness} | {part['sieve']:.5f} | "
            f"{sieve} |"
        )
    faces = {name: [level[0] for level in parts["shapes"][name]["levels"]] for name in EXACT}
    levels = " ... ".join(
        ", ".join(str(faces[name][at]) for name in EXACT) for at in (2, -1)
    )  # fmt: skip
    control = []
    for row in parts["control"]["rows"]:
        got = row["got"]
        errors = [
            max(abs(one[at] - row[name]) for one in got) if got else None
            for at, name in enumerate(("sphericity", "roundness"))
        ]
        shown = [
            "" if error is None else format(error, form)
            for error, form in zip(errors, (".0e", ".3f"), strict=True)
        ]
        control.append(
            f"| {row['sphericity']:.2f} | {row['roundness']:.2f} | {row['refused']} | "
            f"{' | '.join(shown)} |"
        )
    gap = parts["shapes"]["sieve_gap"]
    return {
        "shapes": "\n".join(shapes), "levels": levels, "control": "\n".join(control),
        "sieve_gap": f"{gap[0]:.0e} (median) and {gap[2]:.1e} (greatest)",
    }  # fmt: skip


def _cost_values(rows: list[Data], scan: Data) -> Data:
    first = {row["grain"]: row for row in rows if row["mesh"] == "as made"}
    table, coarse = [], []
    for row in rows:
        size = [abs(error) for error in row["error"]]
        start = first[row["grain"]]
        cost = row["tetrahedra"] / row["step"] / (start["tetrahedra"] / start["step"])
        if row["mesh"] == "as made":
            coarse.append(max(size))
        table.append(
            f"| {row['grain'] + 1} | {row['mesh']} | {row['tetrahedra']:,} | {row['nodes']:,} | "
            f"{max(size):.1%} | "
            f"{sum(row['error']) / len(size):+.1%} | {1e6 * row['step']:.2f} µs | {cost:.0f} |"
        )
    second = [row for row in rows if row["mesh"] == "halved"]
    factor = [8 * first[row["grain"]]["step"] / row["step"] for row in second]
    others = [max(map(abs, row["error"])) for row in rows if row["mesh"].startswith("gmsh")]
    return {
        "stiffness": "\n".join(table), "reference": max(row["reference_error"] for row in rows),
        "coarse_error": f"{min(coarse):.0%} to {max(coarse):.0%}",
        "gmsh_error": f"{min(others):.0%} to {max(others):.0%}",
        "cost_factor": sum(factor) / len(factor), "scan_triangles": scan["triangles"],
        "scan": "\n".join(
            f"| {row['triangles']} | {row['tetrahedra']:,} | {row['inertia_error']:.1%} | "
            f"{row['sieve_error']:+.1%} | {row['sphericity']:.3f} | {row['roundness']:.2f} | "
            f"{row['radius_ratio']:.3f} | {1e6 * row['step']:.2f} µs |"
            for row in scan["rows"]
        ),
    }  # fmt: skip


def _sleeper_values(part: Data) -> Data:
    sleepers = []
    for row in part["shapes"]:
        others = ", ".join(f"{kind} {frequency:.0f}" for kind, frequency in row["others"])
        sleepers.append(
            f"| {row['name']} | {row['mass']:.0f} kg | {joined(row['vertical'], '.0f')} | "
            f"{joined(row['beam'], '.0f')} | {others} |"
        )
    return {
        "sleepers": "\n".join(sleepers),
        "default_modes": joined(part["shapes"][1]["vertical"], ".0f"),
        "wedges": "\n".join(
            f"| {end:g} m | {joined(f, '.0f')} | {f[1] / f[0]:.2f} | {f[2] / f[0]:.2f} |"
            for end, f in part["wedges"]
        ),
        "ratio_two": part["shapes"][0]["vertical"][1] / part["shapes"][0]["vertical"][0],
        "ratio_three": part["shapes"][0]["vertical"][2] / part["shapes"][0]["vertical"][0],
        "seated_own": joined(part["seated"]["frequency"], ".0f"),
        "seated": joined(part["seated"]["nearest"], ".0f"),
        "seated_heights": joined(part["seated"]["height"], ".3f"),
        "wanted_modes": joined(part["wanted"]["frequency"], ".0f"),
        "wanted": joined(part["wanted"]["height"], ".3f"),
        "meshes": "\n".join(
            f"| {' x '.join(map(str, row['cells']))} cells | {row['tetrahedra']:,} | "
            f"{joined(row['vertical'], '.1f')} | {joined(row['error'], '+.1%')} | "
            f"{row['cpu_s']:.1f} s |"
            for row in part["meshes"]
        ),
    }


def _load_values(part: Data) -> Data:
    greatest = max(size for _, size in part["peaks"])
    shown = [(f, size) for f, size in part["peaks"] if size > 0.5 * greatest]
    return {
        "elastic": part["elastic_length"], "share_most": part["share"],
        "share_least": part["least_share"], "greatest": part["greatest"] / 1e3,
        "least": part["least"] / 1e3, "duration": part["duration"],
        "impulse": abs(part["impulse_error"]), "car": part["car_frequency"],
        "peaks": ", ".join(
            f"{f / part['car_frequency']:.2f} ({size / 1e3:.1f} kN s)" for f, size in shown
        ),
    }  # fmt: skip


def main() -> None:
    """Write the page and its pictures."""
    parts = record_read()
    write_atomically(PAGE, page(parts))
    grains_picture(PAGE.with_suffix(".png"), parts)
    train_picture(PAGE.with_name("ballast-grains-train.png"), parts)
    print(PAGE)


if __name__ == "__main__":
    main()
