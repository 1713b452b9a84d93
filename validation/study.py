"""One way to keep a study's record, draw its figure and write its page.

A study is a folder ``validation/studies/NAME`` that reads like an experiment:

- ``__init__.py``: the question, the answer and the design, fixed before the run, and ``ROOMS``,
  the code that it measures (`validation.age`);
- ``run.py``: ``PARTS``, each measured by a function that returns a row of the record;
- ``bars.py``: ``check_bars(rows) -> list[Check]``, the record's figures against their bars;
- ``page.py``: ``describe(rows) -> dict[str, str]``, the text for each mark of ``page.md``, and
  ``draw(rows, picture)``, the one figure.

    python -m validation.study NAME run [--only PART ...]   # measure: record.jsonl in the folder
    python -m validation.study NAME page                    # docs/NAME.md and docs/NAME.png
    trackbed validate NAME                                  # the bars, from the record
"""

from __future__ import annotations

import argparse
import json
import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from trackbed.run_files.provenance import record_provenance as provenance
from trackbed.run_files.whole import write_whole
from validation.age import describe_age, digest_rooms, excuse_page

if TYPE_CHECKING:
    from validation.case import Check

Row = dict[str, Any]
STUDIES = Path(__file__).with_name("studies")
DOCS = Path(__file__).parents[1] / "docs"
MARK = re.compile(r"<[A-Z][A-Z0-9_]*>|\{\{\w+\}\}")


def list_studies() -> list[str]:
    """Names of the studies: the folders of ``validation/studies``, with dashes."""
    return sorted(module.name.replace("_", "-") for module in iter_modules([str(STUDIES)]))


def import_part(name: str, part: str) -> Any:
    """The module ``part`` (run, bars or page) of the study ``name``."""
    return import_module(f"validation.studies.{name.replace('-', '_')}.{part}")


def find_record(name: str) -> Path:
    """Where the record of a study is."""
    return STUDIES / name.replace("-", "_") / "record.jsonl"


def read_record(path: Path) -> list[Row]:
    """The rows of a record; a line cut off by a kill is the last one and is left out."""
    lines = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1] if line]


def measure_parts(
    name: str, parts: Mapping[str, Callable[[], Row]], only: Sequence[str], path: Path
) -> None:
    """Measure ``only`` these parts; each replaces its row of the record at ``path`` once done."""
    for part in only:
        started = time.process_time()
        row = {"part": part, **parts[part]()}
        row["cpu_s"] = round(time.process_time() - started, 1)
        command = ["python", "-m", "validation.study", name, "run", "--only", part]
        row |= {"origin": provenance(command), "code": digest_rooms(name)}
        known = {old["part"]: old for old in (read_record(path) if path.exists() else [])}
        known[part] = row
        ordered = [
            *(one for one in parts if one in known),
            *(one for one in known if one not in parts),
        ]
        write_whole(path, "".join(json.dumps(known[one]) + "\n" for one in ordered))
        print(json.dumps(row), flush=True)


def fill_page(template: str, parts: Mapping[str, str]) -> str:
    """A template whose marks ``{{NAME}}`` and ``<NAME>`` are replaced by the part of that name.

    ValueError where a part has no mark in the template, or a mark no part.
    """
    for name, part in parts.items():
        marks = ("{{" + name + "}}", f"<{name}>")
        if not any(mark in template for mark in marks):
            raise ValueError(f"the template has no mark for {name}")
        for mark in marks:
            template = template.replace(mark, part)
    if left := MARK.search(template):
        raise ValueError(f"no part for the mark {left.group()}")
    return template


def format_table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *lines])


def format_checks(checks: Iterable[Check]) -> str:
    """Bars of a study as a table in Markdown."""
    lines = [
        [check.name, f"{check.value:.4g} {check.unit}".rstrip(), check.asked, check.verdict]
        for check in checks
    ]
    return format_table(["bar", "value", "asked", ""], lines)


def summarise_bars(checks: Iterable[Check]) -> str:
    """How many bars of a study are met, and a line for each that is missed."""
    barred = [check for check in checks if check.barred]
    missed = [check for check in barred if not check.holds]
    if not missed:
        return f"All {len(barred)} bars are met."
    lines = [f"- {one.name}: {one.value:.3g}, bar {one.asked}; {one.why}" for one in missed]
    met = len(barred) - len(missed)
    head = f"Of {len(barred)} bars {met} {'is' if met == 1 else 'are'} met.  Missed:"
    return "\n".join([head, "", *lines])


def estimate_mean(values: npt.ArrayLike, level: float = 0.95) -> tuple[float, float]:
    """Mean of values (k,) and half the width of Student's interval of it; nan for a single one."""
    found = np.asarray(values, dtype=float)
    count = len(found)
    if count < 2:
        return float(found.mean()), float("nan")
    error = float(found.std(ddof=1)) / np.sqrt(count)
    return float(found.mean()), float(student.ppf(0.5 + level / 2, count - 1)) * error


def describe_commits(commits: Iterable[str]) -> str:
    """The three commits that made most rows, with their numbers of rows, and how many others."""

    def shorten(commit: str) -> str:
        digits, _, modified = commit.partition("-")
        return f"`{digits[:10]}`" + (" with changed files" if modified else "")

    counted = Counter(map(shorten, commits))
    words = ", ".join(f"{name} ({count:,})" for name, count in counted.most_common(3))
    return words + (f" and {len(counted) - 3} more" if len(counted) > 3 else "")


def make_page(name: str, rows: Sequence[Row]) -> str:
    """The text of ``docs/NAME.md`` from the record of the study."""
    template = find_record(name).with_name("page.md").read_text(encoding="utf-8")
    return excuse_page(name, fill_page(template, import_part(name, "page").describe(rows)))


def write_page(name: str) -> None:
    """Write ``docs/NAME.md`` and its figure; print which parts are older than their code."""
    rows = read_record(find_record(name))
    DOCS.joinpath(f"{name}.md").write_text(make_page(name, rows), "utf-8")
    import_part(name, "page").draw(rows, DOCS / f"{name}.png")
    if age := describe_age(name, rows):
        print(age)


def main(words: Sequence[str] | None = None) -> None:
    """``python -m validation.study NAME run|page``."""
    parser = argparse.ArgumentParser(
        prog="python -m validation.study", description=(__doc__ or "").splitlines()[0],
        allow_abbrev=False,
    )  # fmt: skip
    parser.add_argument("name", choices=list_studies())
    parser.add_argument("step", choices=("run", "page"))
    parser.add_argument(
        "--only", nargs="+", metavar="PART", help="measure these parts of the record"
    )
    arguments = parser.parse_args(words)
    if arguments.step == "page":
        write_page(arguments.name)
        return
    parts = import_part(arguments.name, "run").PARTS
    only = arguments.only or list(parts)
    if unknown := [part for part in only if part not in parts]:
        parser.error(f"{arguments.name} has no part {unknown[0]}; its parts are {', '.join(parts)}")
    measure_parts(arguments.name, parts, only, find_record(arguments.name))


if __name__ == "__main__":
    main()
