"""Pictures of docs/ballast-grains.md: grains, grading, error against cost; sleeper and train."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.grain_form import GrainRecipe
from qdem_fem.grain_grading import PAPER_SIZE
from qdem_fem.grain_mesh import grain_faces
from qdem_fem.grain_set import grains_make
from qdem_fem.load_train import Track, Train, train_record, train_spectrum
from qdem_fem.mesh_checks import FloatArray, IntArray
from qdem_fem.surface import face_area_vectors

Data = dict[str, Any]
LIGHT = np.array([0.35, 0.4, 0.85])
STONE = np.array([0.72, 0.68, 0.62])
KINDS = (
    ("sphericity 0.84, roundness 0.64, convex", GrainRecipe(0.84, 0.0, 0.64, 0.0)),
    ("sphericity 0.84, roundness 0.78, convex", GrainRecipe(0.84, 0.0, 0.78, 0.0)),
    ("sphericity 0.74, roundness 0.66, convex", GrainRecipe(0.74, 0.0, 0.66, 0.0)),
    ("sphericity 0.80, roundness 0.66, dents of 0.3", GrainRecipe(0.80, 0.0, 0.66, 0.0, 0.3)),
)


def grain_draw(axes: Any, nodes: FloatArray, faces: IntArray, at: tuple[float, float]) -> None:
    """A grain seen along z, its middle ``at`` (mm, mm): faces by height, shaded by a lamp."""
    from matplotlib.collections import PolyCollection

    normal = face_area_vectors(nodes, faces)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    seen = np.flatnonzero(normal[:, 2] > 0)
    seen = seen[np.argsort(nodes[faces[seen], 2].mean(axis=1))]
    bright = 0.35 + 0.65 * np.clip(normal[seen] @ LIGHT / np.linalg.norm(LIGHT), 0, 1)
    shapes = 1e3 * nodes[faces[seen], :2] + np.array(at)
    axes.add_collection(
        PolyCollection(shapes, facecolors=np.clip(bright[:, None] * STONE, 0, 1),
                       edgecolors="#5b5348", linewidths=0.3)
    )  # fmt: skip


def grains_picture(path: Path, parts: Data) -> None:
    """Rows of grains of each kind; grading of the 5,700; error against cost."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 9.8), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.4, 1])
    axes = figure.add_subplot(grid[0, :])
    for row, (words, recipe) in enumerate(KINDS):
        grains = grains_make(8, 5, recipe, PAPER_SIZE)
        for grain in range(8):
            nodes, corner_faces = grains.parts(grain)
            grain_draw(axes, nodes, grain_faces(corner_faces), (105.0 * grain, -105.0 * row))
        axes.text(-60, -105.0 * row + 48, words, fontsize=8, va="bottom")
    axes.set(xlim=(-75, 800), ylim=(-380, 70), aspect="equal", title="Grains of 45 to 55 mm sieve "
             "size, about 100 tetrahedra each (faces as meshed)")  # fmt: skip
    axes.plot([690, 740], [-372, -372], "k-", lw=2)
    axes.text(745, -372, "50 mm", va="center", fontsize=8)
    axes.axis("off")
    _grading(figure.add_subplot(grid[1, 0]), parts["set"])
    _errors(figure.add_subplot(grid[1, 1]), parts["stiffness"]["rows"])
    _save(figure, path)


def _grading(axes: Any, part: Data) -> None:
    size = 1e3 * np.array(part["sieves"])
    axes.fill_between(size, 100 * np.array(part["least"]), 100 * np.array(part["most"]),
                      color="#c9ced6", label="EN 13450, 31.5/50 A")  # fmt: skip
    axes.plot(size, 100 * np.array(part["asked"]), "k--", lw=1, label="asked")
    axes.plot(size, 100 * np.array(part["got"]), "o", color="#0b5394", label="5,700 grains")
    axes.set(xscale="log", xlabel="square hole [mm]", ylabel="mass that passes [%]",
             title="Grading", xticks=size, xticklabels=[f"{s:g}" for s in size])  # fmt: skip
    axes.minorticks_off()
    axes.legend(fontsize=8)


def _errors(axes: Any, rows: list[Data]) -> None:
    for grain, colour in enumerate(("#0b5394", "#6aa84f", "#cc7a00")):
        own = [row for row in rows if row["grain"] == grain and "gmsh" not in row["mesh"]]
        count = [row["tetrahedra"] for row in own]
        axes.loglog(count, [max(map(abs, row["error"])) for row in own], "o-", color=colour,
                    label=f"grain {grain + 1}")  # fmt: skip
        other = next(row for row in rows if row["grain"] == grain and "gmsh" in row["mesh"])
        axes.loglog(other["tetrahedra"], max(map(abs, other["error"])), "x", color=colour)
        for row in own:
            axes.annotate(f"{1e6 * row['step']:.2f} µs", xytext=(4, 3), fontsize=6,
                          xy=(row["tetrahedra"], max(map(abs, row["error"]))),
                          textcoords="offset points", color=colour)  # fmt: skip
    axes.set(xlabel="tetrahedra of a grain", ylabel="greatest error of four frequencies [-]",
             title="Stiffness error against cost, with the critical step (x: gmsh)")  # fmt: skip
    axes.legend(fontsize=8)


def train_picture(path: Path, parts: Data) -> None:
    """The record of the made-up train, its spectrum, and sleeper profiles with their modes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2)
    train, track = Train(), Track()
    record = train_record(train, track, 0.13 * 0.17)
    axes = figure.add_subplot(grid[0, :])
    axes.plot(record.time, record.pressure[:, 0] / 1e6, color="#0b5394", lw=0.8)
    axes.set(xlabel="time [s]", ylabel="pressure on a rail seat [MPa]",
             title="Five cars at 32 m/s (made up, not the paper's record)")  # fmt: skip
    axes = figure.add_subplot(grid[1, 0])
    frequency = np.linspace(0, 60, 3001)
    axes.semilogy(frequency, np.abs(train_spectrum(frequency, train, track)) / 1e3, lw=0.8,
                  color="#0b5394")  # fmt: skip
    for n in range(1, 38):
        axes.axvline(n * parts["load"]["car_frequency"], color="#c9ced6", lw=0.4, zorder=0)
    axes.set(xlabel="frequency [Hz]", ylabel="force spectrum [kN s]", ylim=(1e-3, None),
             title="Its spectrum; grey: multiples of speed over car length")  # fmt: skip
    axes = figure.add_subplot(grid[1, 1])
    wanted = parts["sleeper"]["wanted"]
    half = np.array(wanted["half"])
    axes.plot(
        [0, 1],
        [0.174, 0.174],
        color="#0b5394",
        label="as assumed: "
        + ", ".join(f"{f:.0f}" for f in parts["sleeper"]["shapes"][1]["vertical"])
        + " Hz",
    )
    axes.plot(half, wanted["height"], "o-", color="#cc0000", label="a profile with: "
              + ", ".join(f"{f:.0f}" for f in wanted["frequency"]) + " Hz")  # fmt: skip
    seated = parts["sleeper"]["seated"]
    axes.plot(
        seated["half"],
        seated["height"],
        "s--",
        color="#cc7a00",
        label="nearest with seats, "
        "E free: " + ", ".join(f"{f:.0f}" for f in seated["nearest"]) + " Hz",
    )
    axes.axvspan(0.501, 0.631, color="#c9ced6", zorder=0, label="rail seat")
    axes.set(xlabel="distance from the centre [m]", ylabel="height of the sleeper [m]",
             ylim=(0, 0.2), title="What 200, 400, 800 Hz would ask for")  # fmt: skip
    axes.legend(fontsize=8)
    _save(figure, path)


def _save(figure: Any, path: Path) -> None:
    temporary = path.with_name(path.name + ".partial")
    figure.savefig(temporary, dpi=110, format="png")
    temporary.replace(path)
