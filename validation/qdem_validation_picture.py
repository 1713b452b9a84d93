"""The picture of the validation of QDEM, from the tables beside its record.

    python -m validation.qdem_validation_picture        draws docs/qdem-validation.png

No run is repeated for it: a part that is not in the record leaves its panel empty, and says so.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.spectra import amplitude_spectrum
from validation.qdem_record import RECORD, ROOT, table_path, table_read
from validation.qdem_static import TIP_PAPER

PICTURE = ROOT / "docs" / "qdem-validation.png"
OURS, JUDGE, OTHER, THEORY = "#0b5394", "#cc7a00", "#6aa84f", "#cc0000"
Tables = dict[str, NDArray[Any]]
WINDOW = (1.94, 2.2)
"""Times shown of the unloading [s]."""


def draw(record: Path, picture: Path) -> None:
    """Six panels: histories, spectrum, convergence, cost and creep."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 9), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (panel, *names) in zip(figure.subplots(2, 3).flat, PANELS, strict=True):
        if all(table_path(name, record).exists() for name in names):
            panel(axes, *(table_read(name, record) for name in names))
            axes.grid(True, which="both", alpha=0.2)
        else:
            axes.text(0.5, 0.5, f"not recorded: {', '.join(names)}", ha="center")
            axes.set_axis_off()
    temporary = picture.with_name(picture.name + ".partial")
    figure.savefig(temporary, dpi=90, format="png")
    temporary.replace(picture)


def panel_loading(axes: Any, table: Tables) -> None:
    """Fig. 2 a of the paper: the tip while the load grows and rests."""
    time, ours, judge = (table[name] for name in ("time [s]", "QDEM [um]", "Newmark [um]"))
    chosen = time <= 2.0
    axes.plot(time[chosen], judge[chosen], color=JUDGE, linewidth=4, label="Newmark, same mesh")
    axes.plot(time[chosen], ours[chosen], color=OURS, linewidth=1, label="QDEM")
    axes.axhline(-1e6 * TIP_PAPER, color="0.5", linestyle=":", label="paper, 488,361 elements")
    axes.set(
        title="Cantilever, 10,800 elements: 200 N within 1 s",
        xlabel="time [s]",
        ylabel="displacement of the tip [µm]",
    )
    axes.legend(fontsize=8)


def panel_unloading(axes: Any, table: Tables) -> None:
    """Fig. 2 b: the tip after the load has gone, and the difference of the two."""
    time, ours, judge = (table[name] for name in ("time [s]", "QDEM [um]", "Newmark [um]"))
    chosen = (time >= WINDOW[0]) & (time <= WINDOW[1])
    time, ours, judge = time[chosen], ours[chosen], judge[chosen]
    axes.plot(time, judge, color=JUDGE, linewidth=4, label="Newmark, same mesh")
    axes.plot(time, ours, color=OURS, linewidth=1, label="QDEM")
    axes.plot(time, 10 * (ours - judge), color=OTHER, linewidth=1, label="10 times the difference")
    axes.set(
        title="The same, let go at 2 s", xlabel="time [s]", ylabel="displacement of the tip [µm]"
    )
    axes.legend(fontsize=8, loc="upper right")


def panel_spectrum(axes: Any, release: Tables, modes: Tables) -> None:
    """Spectrum of a corner of the free end, let go under a skew force; eigenvalues marked."""
    for name, label, colour in (("u_z [um]", "u_z", OURS), ("u_y [um]", "u_y", OTHER)):
        time = release["time [s]"]
        even = np.linspace(time[0], time[-1], len(time))  # of times written with nine digits
        frequency, amplitude = amplitude_spectrum(even, release[name])
        axes.plot(frequency, amplitude, color=colour, linewidth=1.2, label=f"QDEM, {label}")
    top = axes.get_ylim()[1]
    pairs = zip(modes["mode"], modes["scikit-fem [Hz]"], strict=True)
    for number, (name, value) in enumerate(pairs):
        axes.axvline(value, color=JUDGE, linestyle="--", linewidth=1, zorder=0)
        # modes come in pairs, one in each plane: one name to the left, one to the right
        side = "left" if number % 2 or value > 200 else "right"
        axes.text(value, top, f" {name} \n {value:.1f} ", fontsize=7, va="bottom", ha=side)
    axes.plot([], [], color=JUDGE, linestyle="--", label="scikit-fem, same mesh")
    axes.set(
        yscale="log",
        ylim=(1e-4, 5 * top),
        xlim=(-30, 1.25 * modes["scikit-fem [Hz]"].max()),
        title="Five modes of the cantilever, 46,080 elements",
        xlabel="frequency [Hz]",
        ylabel="amplitude [µm]",
    )
    axes.legend(fontsize=8, loc="lower left")


MARKS = {
    "QDEM, settled": ("o", OURS),
    "QDEM, relaxed": ("^", "#3d9be9"),
    "scikit-fem, linear": ("s", JUDGE),
    "scikit-fem, quadratic": ("*", THEORY),
}


def panel_convergence(axes: Any, table: Tables, large: Tables) -> None:
    """Error of the tip over the size of the elements, with a slope of two."""
    table = _joined(table, large)
    size = table["elements"] ** (-1 / 3)
    for method in ("scikit-fem, linear", "QDEM, relaxed", "QDEM, settled"):
        marker, colour = MARKS[method]
        for pattern, inside in (("six", colour), ("five", "white")):
            chosen = (table["method"] == method) & (table["tetrahedra a cell"] == pattern)
            axes.plot(
                size[chosen], errors(table)[chosen], marker, color=colour, markerfacecolor=inside,
                markersize=10 if method == "scikit-fem, linear" else 6,
                label=f"{method}, {pattern} tetrahedra a cell",
            )  # fmt: skip
    ends = np.array([size.min(), size.max()])
    axes.plot(ends, 0.6 * (ends / ends[1]) ** 2, color="0.5", linestyle=":", label="order 2")
    axes.set(
        xscale="log",
        yscale="log",
        title="Static tip of the cantilever: error and mesh",
        xticks=[0.02, 0.05, 0.1],
        xticklabels=["0.02", "0.05", "0.1"],
        xlabel="(number of elements)$^{-1/3}$",
        ylabel="error of the tip, to the limit of quadratic elements",
    )
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.legend(fontsize=7)


def panel_cost(axes: Any, table: Tables, large: Tables) -> None:
    """The same error over processor time: five tetrahedra a cell, and quadratic ones."""
    table = _joined(table, large)
    for method, (marker, colour) in MARKS.items():
        quadratic = method == "scikit-fem, quadratic"
        pattern = "six" if quadratic else "five"
        chosen = (table["method"] == method) & (table["tetrahedra a cell"] == pattern)
        if quadratic:  # the last one is what the limit is made of
            chosen &= table["elements"] < table["elements"][chosen].max()
        order = np.argsort(table["elements"][chosen])
        axes.plot(
            table["processor time [s]"][chosen][order], errors(table)[chosen][order],
            marker=marker, color=colour, label=method,
        )  # fmt: skip
        if method == "scikit-fem, linear":
            continue  # the same meshes as QDEM's
        for index in np.flatnonzero(chosen):
            axes.annotate(
                f"{table['elements'][index] / 1000:.3g}k", xytext=(4, 4), fontsize=6, color=colour,
                xy=(table["processor time [s]"][index], errors(table)[index]),
                textcoords="offset points",
            )  # fmt: skip
    axes.set(
        xscale="log",
        yscale="log",
        title="Static tip: error and cost (elements marked)",
        xlabel="processor time of one thread, set-up included [s]",
        ylabel="error of the tip, to the limit of quadratic elements",
    )
    axes.legend(fontsize=8)


def panel_creep(axes: Any, strain: Tables, stress: Tables, slab: Tables) -> None:
    """Section 3.2: creep and recovery, closed forms and eq. 14."""
    for name, table, judge, colour in (
        ("uniaxial strain", strain, "closed form", OURS),
        ("uniaxial stress", stress, "closed form", OTHER),
        ("ends that do not slip", slab, "scikit-fem", JUDGE),
    ):
        axes.plot(table["time [s]"], table[judge], color=colour, linewidth=3, alpha=0.4)
        axes.plot(
            table["time [s]"][::6], table["QDEM"][::6], ".", color=colour, label=f"QDEM, {name}"
        )
    axes.plot(
        strain["time [s]"], strain["eq. 14"], color=THEORY, linestyle="--", linewidth=1,
        label="eq. 14, its sign put right",
    )  # fmt: skip
    axes.plot([], [], color="0.5", linewidth=3, alpha=0.4, label="closed form, or scikit-fem")
    axes.set(
        title="Creep and recovery, viscosity over E = 0.4 s",
        xlabel="time [s]",
        ylabel="strain over P/EA",
    )
    axes.legend(fontsize=7)


def errors(table: Tables) -> NDArray[np.float64]:
    """Relative error of the tips, to the limit of quadratic elements."""
    return np.abs(table["tip [um]"] / quadratic_limit(table) - 1)


def quadratic_limit(table: Tables) -> float:
    """Limit of the tips by quadratic elements [um], each mesh half as coarse: Aitken's."""
    chosen = table["method"] == "scikit-fem, quadratic"
    first, second, third = table["tip [um]"][chosen][np.argsort(table["elements"][chosen])][-3:]
    return float(third - (third - second) ** 2 / (third - 2 * second + first))


def _joined(table: Tables, more: Tables) -> Tables:
    return {name: np.concatenate([table[name], more[name]]) for name in table}


Panel = tuple[Callable[..., None], *tuple[str, ...]]
PANELS: list[Panel] = [
    (panel_loading, "protocol"),
    (panel_unloading, "protocol"),
    (panel_spectrum, "release", "modes"),
    (panel_convergence, "static", "static-paper-size"),
    (panel_cost, "static", "static-paper-size"),
    (panel_creep, "creep-uniaxial-strain", "creep-uniaxial-stress", "creep-slab"),
]


def main(words: Sequence[str] | None = None) -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description="Draws the validation of QDEM from its record.")
    parser.add_argument("--record", type=Path, default=RECORD, help="the record's .jsonl")
    parser.add_argument("--out", type=Path, default=PICTURE, help="the PNG")
    arguments = parser.parse_args(words)
    draw(arguments.record, arguments.out)
    print(arguments.out)


if __name__ == "__main__":
    main()
