"""The verbs ``compare`` and ``plot``: runs of one kind side by side, in numbers or curves."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from adapters.cli.arguments import add_json, print_json
from adapters.errors import UsageError
from trackbed.run_files import MANIFEST, PLOT, RESULT, SEAL, read_object, refuse_links
from trackbed.run_verbs import describe_run, find_kind, refuse_no_run

NO_RESULTS = ("run_folder", "next", "digests", SEAL)
"""What differs between any two runs and is no result."""
CURVES = {
    "run": ("settlement.csv", {"cycle": "load cycles", "loaded_body_settlement": "loaded body (m)",
            "mean_grain_settlement": "mean grain (m)", "stiffness": "stiffness (N/m)"}),
    "qdem": ("probes.csv", {"time": "time (s)"}),
    "rigid": ("history.csv", {"time": "time (s)", "energy": "energy (J)", "contacts": "contacts"}),
    "line": ("geometry.csv", {"tonnage_mgt": "MGT", "d1_median_m": "D1, median (m)",
             "settlement_m": "settlement (m)", "hanging_over_0.1_mm": "hang by 0.1 mm (-)"}),
}  # fmt: skip
"""Of each kind of run: its table, and its columns with their titles, drawn against the first; of
probes, which have the scene's names, all."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Arguments of ``verb``."""
    several: Any = 2 if verb == "compare" else "+"
    parser.add_argument("runs", nargs=several, metavar="RUN", type=Path, help="a run folder")
    if verb == "compare":
        add_json(parser)
    parser.set_defaults(command=run_compare if verb == "compare" else run_plot)


def run_compare(arguments: argparse.Namespace) -> int:
    """Print the keys of two scenes and the numbers of two runs that differ."""
    find_one_kind(arguments.runs)
    asked = list_unlike(*(read_scene(path) for path in arguments.runs))
    found = list_unlike(*(read_numbers(path) for path in arguments.runs))
    if arguments.json:
        print_json({"runs": [str(path) for path in arguments.runs], "scene": asked, "found": found})
        return 0
    for title, rows in (("scene", asked), ("found", found)):
        heads = f"{title:34} {'first':>14} {'second':>14} {'ratio':>8}"
        print(heads if rows else f"{title}: the same in both")
        for name, (one, other) in rows.items():
            numbers = all(type(value) in (int, float) for value in (one, other))
            ratio = f"{other / one:.4g}" if numbers and one else ""
            print(f"  {name:32} {show_value(one):>14} {show_value(other):>14} {ratio:>8}".rstrip())
    return 0


def run_plot(arguments: argparse.Namespace) -> int:
    """Draw plot.png in the first run, and print its path."""
    from trackbed.report import save_figure
    from trackbed.series_file import read_table

    file, titles = CURVES[find_one_kind(arguments.runs)]
    tables = [read_table(path / file) for path in arguments.runs]
    print(save_figure(lambda: draw_curves(tables, titles), arguments.runs[0] / PLOT))
    return 0


def find_one_kind(runs: Sequence[Path]) -> str:
    """The verb that made all of these runs; `UsageError` for no run, or one of another kind."""
    kinds = []
    for path in runs:
        refuse_no_run(path)
        refuse_links(path)
        kinds.append(kind.verb if (kind := find_kind(path)) else "run")
        if kinds[-1] != kinds[0]:
            raise UsageError(
                f"a {kinds[0]} run and a {kinds[-1]} run have no numbers in common",
                where=f"{runs[0]} and {path}", remedy="give runs of one kind",
            )  # fmt: skip
    return kinds[0]


def read_curve(table: Any, names: Sequence[str]) -> Any:
    """Columns (n, k), without rows that lack one; `UsageError` for what is no number."""
    from trackbed.series_file import find_column

    head = table.header
    places = [head.index(one) if one in head else find_column(table, (one,), ()) for one in names]
    rows = [n for n, row in enumerate(table.rows) if all(row[at].strip() for at in places)]
    kept = replace(table, rows=[table.rows[n] for n in rows], lines=[table.lines[n] for n in rows])
    return kept.read_numbers(places, names)


def draw_curves(tables: Sequence[Any], titles: dict[str, str]) -> Any:
    """A panel for each column, a curve in it for each run."""
    from matplotlib.figure import Figure

    against, *names = titles if len(titles) > 1 else tables[0].header
    figure = Figure(figsize=(7.2, 1 + 1.6 * len(names)))
    panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=True):
        panel.set_ylabel(titles.get(name, f"{name} (m)"))
        for k, table in enumerate(tables):
            style = {"color": COLOURS[k % len(COLOURS)], "label": table.path.parent}
            panel.plot(*read_curve(table, (against, name)), **style)
    panels[0].legend(loc="lower left", bbox_to_anchor=(0, 1))
    panels[-1].set_xlabel(titles[against])
    return figure


def read_scene(path: Path) -> dict[str, Any]:
    """The effective scene of a run, by dotted key."""
    return dict(list_leaves((read_object(path / MANIFEST) or {}).get("scene", {})))


def read_numbers(path: Path) -> dict[str, Any]:
    """What came out of a run, by dotted name: of a settlement run what ``status`` says, of another
    what its command has left; `UsageError` where it has left nothing yet."""
    if (kind := find_kind(path)) is not None and kind.states:
        result = read_object(path / RESULT)
        if result is None:
            remedy = f"first: {describe_run(path, kind)['next']}"
            raise UsageError("this run is not finished", where=str(path), remedy=remedy)
    else:
        from dataclasses import asdict

        from adapters.cli.run import read_record
        from adapters.procedure import judge_progress, make_plain

        result = make_plain(asdict(judge_progress(read_record(path))))
    return dict(list_leaves({name: one for name, one in result.items() if name not in NO_RESULTS}))


def list_leaves(content: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Values inside of tables and lists, by dotted name; the first of a list is 0."""
    if not isinstance(content, dict | list):
        yield name, content
        return
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield from list_leaves(value, f"{name}.{key}" if name else str(key))


def list_unlike(one: dict[str, Any], other: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    """The values that differ in the first six digits, of either; None for what one has not."""
    pairs = {name: (one.get(name), other.get(name)) for name in {**one, **other}}
    return {name: pair for name, pair in pairs.items() if len({*map(show_value, pair)}) > 1}


def show_value(value: Any) -> str:
    """A value as it is printed."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
