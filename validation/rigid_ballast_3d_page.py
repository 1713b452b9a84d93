"""docs/rigid-ballast-3d.md and its plot, from validation/results/rigid-ballast-3d.jsonl."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.run_folder import write_atomically
from validation.rigid_ballast_3d import SAMPLES
from validation.student import interval

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "rigid-ballast-3d.md"
PLOT = ROOT / "docs" / "rigid-ballast-3d.png"
CHAINS = ROOT / "docs" / "rigid-ballast-3d-chains.png"
COLOURS = ("#0072B2", "#E69F00", "#009E73")
"""Told apart by colour-blind readers too (Okabe and Ito)."""
Floats = NDArray[np.float64]
Data = dict[str, Any]

HEAD = """# A sleeper block on polyhedral ballast in space

Convex stones are poured into a box, a block is laid on them and loaded cyclically, by time stepping
at velocity level (`validation/rigid_ballast_3d.py`; box, stones and friction are those of
`scenes/sleeper-3d.toml`, the number of stones and the loads are given in that module).  Pouring and
laying are the same for all steps of a sample; only the cycles are repeated with another step.  The
block slides and sinks, but does not turn, as rails hold a sleeper (a moment of inertia 1e6 times
its own).  A bed of hard stones amplifies every difference: what is compared is the mean of the
samples, never one bed.  Intervals are 95 % (Student's t over the samples).  Costs are CPU seconds
of one thread on a busy machine: provisional.

Contacts are found by kernels of our own: in space separating axes, then clipped faces
(`rigid_lcp.separation_3d`, `rigid_lcp.manifold_3d`), in the plane corners against faces
(`rigid_lcp.detection_2d`).  The library coal does not find them: its GJK and EPA iterate to a
tolerance of 1e-6, where a block must rest for 1e5 steps without creeping 1e-12 m, for which normals
and gaps have to be exact to round-off.  Tests compare distances with coal's.  shapely is not used
either: it gives the area that two polygons share, not the gaps and normals of their contacts.
"""

AGAIN = """
## What the figures are

* settlement: way of the block down from the start of the first cycle, at the smallest load after
  the last one; difference: that of the same sample at the finest step taken off.
* residual: scale-free natural map of the impulses in a step; asked for: 1e-6.
* overlap: the greatest of any two bodies at the end of any step, over the mean diameter of a stone.
* energy gained in a step: the most that kinetic and potential energy grew beyond the work of the
  load, over the work of the load in all cycles.  With friction a body that comes to rest
  within a step may gain `m (h f/m)^2 / 8`, f its load; what the forces lack of an exact solution
  adds to it.

`python -m validation.rigid_ballast_3d --run` goes on where the record stops;
`python -m validation.rigid_ballast_3d` writes this page from it.
"""


def by_step(lines: Sequence[Data]) -> dict[float, list[Data]]:
    """Runs that came to their end, by step from the longest, samples in order."""
    steps = sorted({line["step"] for line in lines}, reverse=True)
    ended = [line for line in lines if line["ok"]]
    return {
        step: sorted(
            (line for line in ended if line["step"] == step), key=lambda line: line["sample"]
        )
        for step in steps
    }


def differences(runs: dict[float, list[Data]], step: float) -> list[float]:
    """Final settlement at a step less that at the finest, sample by sample [m]."""
    finest = {line["sample"]: line for line in runs[min(runs)]}
    return [
        line["settlement"][-1] - finest[line["sample"]]["settlement"][-1]
        for line in runs[step]
        if line["sample"] in finest
    ]


def page(lines: Sequence[Data]) -> str:
    """The page as Markdown."""
    runs = by_step(lines)
    first = lines[0]
    cycles = max(len(line["settlement"]) for line in lines)
    parts = [
        HEAD,
        f"{first['stones']} stones, {len({line['sample'] for line in lines})} of {SAMPLES} "
        f"samples, {cycles} cycles.  Machine: {first['machine']}; "
        f"commit {first['commit'] or 'unknown'}.\n",
        "![settlement against cycles, and difference against cost](rigid-ballast-3d.png)\n",
        "![force chains under the block](rigid-ballast-3d-chains.png)\n",
        "Force chains in `scenes/sleeper-3d.toml` under the block, seen from the side: width by "
        "normal force.\n",
        "| step | settlement | difference | CPU a cycle | CPU a step | contacts (carry) | sliding |"
        "\n|" + "---|" * 7,
        *(_answer(runs, step, cycles) for step in runs if runs[step]),
        "",
        "| step | residual: median | 99 % | worst | overlap | energy gained in a step |\n|"
        + "---|" * 6,
        *(_quality(runs[step], step) for step in runs if runs[step]),
        "",
        _verdict(runs),
    ]
    failed = [line for line in lines if not line["ok"]]
    if failed:
        parts.append("\n## Runs that were stopped\n")
        parts += [
            f"* sample {line['sample']}, step {1e3 * line['step']:g} ms: {line['why']}."
            for line in failed
        ]
    return "\n".join([*parts, AGAIN])


def _answer(runs: dict[float, list[Data]], step: float, cycles: int) -> str:
    mine = runs[step]
    mean, half = interval([line["settlement"][-1] for line in mine])
    cost = np.mean([line["cpu_s"] for line in mine])
    steps = np.mean([line["steps"] for line in mine])
    shift = "-"
    if step != min(runs):
        apart, wide = interval(differences(runs, step))
        shift = f"{1e3 * apart:+.3f} ± {1e3 * wide:.3f} mm"
    found, carry, sliding = (
        np.mean([line[k] for line in mine]) for k in ("contacts", "carrying", "sliding")
    )
    return (
        f"| {1e3 * step:g} ms | {1e3 * mean:.3f} ± {1e3 * half:.3f} mm | {shift} | "
        f"{cost / cycles:.2g} s | {1e3 * cost / steps:.3g} ms | {found:.0f} ({carry:.0f}) | "
        f"{100 * sliding:.0f} % |"
    )


def _quality(mine: Sequence[Data], step: float) -> str:
    size = np.mean([line["size"] for line in mine])
    gained = max(line["gain"] / sum(line["work"]) for line in mine)
    return (
        f"| {1e3 * step:g} ms | {np.median([line['residual_median'] for line in mine]):.1e} | "
        f"{max(line['residual_99'] for line in mine):.1e} | "
        f"{max(line['residual_worst'] for line in mine):.1e} | "
        f"{max(line['overlap'] for line in mine) / size:.1e} | {gained:.1e} |"
    )


def _ratio(runs: dict[float, list[Data]], step: float) -> str:
    """Settlement over that at the finest step, geometric mean: samples differ tenfold."""
    finest = {line["sample"]: line["settlement"][-1] for line in runs[min(runs)]}
    pairs = [
        (line["settlement"][-1], finest[line["sample"]])
        for line in runs[step]
        if line["sample"] in finest
    ]
    if min(min(pair) for pair in pairs) <= 0:
        return ""
    middle, wide = interval([float(np.log(one / other)) for one, other in pairs])
    low, mean, high = np.exp([middle - wide, middle, middle + wide])
    return f"; as a ratio {mean:.2f} ({low:.2f} to {high:.2f})"


def _verdict(runs: dict[float, list[Data]]) -> str:
    """How unlike the samples are, and for every coarser step: does its settlement differ?"""
    least, *_, most = sorted(1e3 * line["settlement"][-1] for line in runs[min(runs)])
    said = [f"At {1e3 * min(runs):g} ms the samples settle by {least:.2g} to {most:.2g} mm."]
    for step in runs:
        if step == min(runs) or len(differences(runs, step)) < 2:
            continue
        apart, wide = interval(differences(runs, step))
        differs = "differs" if abs(apart) > wide else "can not be told"
        said.append(
            f"At {1e3 * step:g} ms the mean settlement {differs} from that at "
            f"{1e3 * min(runs):g} ms: {1e3 * apart:+.3f} mm within ± {1e3 * wide:.3f} mm"
            f"{_ratio(runs, step)}."
        )
    return "\n".join(said)


def plot_write(lines: Sequence[Data], path: Path = PLOT) -> None:
    """Settlement against cycles, and difference from the finest step against cost."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    runs = {step: mine for step, mine in by_step(lines).items() if mine}
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    for number, (step, mine) in enumerate(runs.items()):
        curves = 1e3 * np.array([line["settlement"] for line in mine])
        cycle, colour = np.arange(1, curves.shape[1] + 1), COLOURS[number % len(COLOURS)]
        left.plot(cycle, curves.T, color=colour, linewidth=0.7, alpha=0.5)
        left.plot(
            cycle, curves.mean(axis=0), color=colour, linewidth=2.2, label=f"{1e3 * step:g} ms"
        )
        if step == min(runs):
            continue
        apart, wide = interval(differences(runs, step))
        cost = np.mean([line["cpu_s"] / len(line["settlement"]) for line in mine])
        right.errorbar(
            cost, 1e3 * apart, yerr=1e3 * wide, color=colour, marker="o", capsize=4,
            label=f"{1e3 * step:g} ms",
        )  # fmt: skip
    right.axhline(0.0, color="0.6", linewidth=0.8)
    right.set_xlim(0.0, 1.15 * right.get_xlim()[1])
    left.set(xlabel="load cycle", ylabel="settlement of the block [mm]", yscale="log")
    right.set(
        xlabel="CPU time a cycle [s], one thread",
        ylabel=f"difference from {1e3 * min(runs):g} ms [mm]",
    )  # fmt: skip
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    left.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    left.yaxis.set_minor_formatter(NullFormatter())
    left.set_title("each sample (thin) and their mean", fontsize=10, loc="left")
    right.set_title("mean of the samples, 95 % interval", fontsize=10, loc="left")
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(title="step", fontsize="small")
    figure.savefig(path, dpi=140)


def chains_write(folder: Path, path: Path = CHAINS) -> None:
    """Force chains of a finished run of ``scenes/sleeper-3d.toml``, from the side, in that frame
    of its last quarter in which contacts carry most."""
    from rigid_lcp.pictures import force_scale, picture_state, window_of
    from rigid_lcp.run_folder import RunFolder, frame_read
    from rigid_lcp.scene_file import scene_build, scene_read

    paths = RunFolder(folder).frames()
    frames = [frame_read(each) for each in paths[3 * len(paths) // 4 :]]
    shown = max(frames, key=lambda frame: float(frame["contacts"].normal_force.sum()))
    scene = scene_build(scene_read(folder / "scene.toml"))
    motion, contacts = shown["motion"], shown["contacts"]
    scale = force_scale([contacts.normal_force])
    title = f"t = {float(shown['time']):.2f} s"
    picture_state(
        scene, motion, contacts, window_of(scene, [motion.position]), scale, title
    ).savefig(path)


def page_write(lines: Sequence[Data]) -> None:
    """Write page and plot."""
    plot_write(lines)
    write_atomically(PAGE, page(lines))
