"""The report and the status of a run: whole, self-contained, honest about what is missing."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.files.run_folder import RunFolder
from adapters.procedure.history import make_plain
from adapters.procedure.progress import Progress
from adapters.procedure.record import read_run_record
from adapters.procedure.run import run_scene
from adapters.procedure.status import read_status
from adapters.report.figure import draw_settlement
from adapters.report.page import write_report
from adapters.scene.file import load_scene
from adapters.scene.model import list_omissions
from trackbed.command import main
from trackbed.report.page import format_number, format_share, mark_number
from trackbed.scenes import find_scene_file

pytestmark = pytest.mark.lowest

ROOT = Path(__file__).parents[2]

SMALL = (
    'engine.name="fake"',
    "sample.count=30",
    "procedure.k_i=4",
    "procedure.k=6",
    "procedure.h=5",
    "procedure.total_cycles=40",
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the fake engine with its control, and its report."""
    folder = tmp_path_factory.mktemp("report") / "run"
    run_scene(
        find_scene_file("karrech-coarse"),
        folder,
        control=True,
        overrides=SMALL,
        progress=Progress(quiet=True),
    )
    write_report(folder)
    return folder


@pytest.fixture
def copy(finished: Path, tmp_path: Path) -> Path:
    """A copy of that run without its report."""
    folder = tmp_path / "run"
    shutil.copytree(finished, folder, ignore=shutil.ignore_patterns("report.*", "figures"))
    return folder


def report_of(folder: Path) -> tuple[dict[str, Any], str]:
    """Numbers and page of the report that is in ``folder``."""
    page = (folder / "report.html").read_text(encoding="utf-8")
    return json.loads((folder / "report.json").read_text(encoding="utf-8")), page


def written(folder: Path) -> tuple[dict[str, Any], str]:
    """Write the report of ``folder``; its numbers and page."""
    assert write_report(folder) == folder / "report.html"
    return report_of(folder)


def page_tree(page: str) -> ElementTree.Element:
    """The page as a tree; raises when a tag is not closed."""
    assert page.startswith("<!DOCTYPE html>\n")
    return ElementTree.fromstring(page.partition("\n")[2])


def shown(page: str) -> set[float]:
    """The full values of all numbers on the page."""
    return {float(data.attrib["value"]) for data in page_tree(page).iter("data")}


def numbers_in(content: Any) -> Iterator[float]:
    """All numbers of a JSON content."""
    if isinstance(content, dict):
        content = list(content.values())
    if isinstance(content, list):
        for inner in content:
            yield from numbers_in(inner)
    elif isinstance(content, float):
        yield content


def test_page_shows_the_numbers_of_the_json(finished: Path) -> None:
    """Every number of the tables in report.json is on the page, to the last bit."""
    numbers, page = report_of(finished)
    for row in numbers["error_rows"][1:]:
        del row["speed_up_with_preparation"]  # the claim has this run's
    printed = ("error_rows", "jumps", "costs", "preparation", "loaded_body", "mean_grain")
    wanted = {value for name in printed for value in numbers_in(numbers[name])}
    assert not wanted - shown(page)
    assert len(wanted) > 30


def test_status_ends_with_what_came_out(finished: Path, tmp_path, capsys) -> None:
    """``trackbed status`` says by units what report.json says; --json keeps its keys."""
    numbers = json.loads((finished / "report.json").read_text())
    run = next(row for row in numbers["error_rows"] if row["name"] == "this run")
    assert main(["status", str(finished)]) == 0
    grains, sleeper = capsys.readouterr().out.splitlines()[-2:]
    assert grains == (
        f"mean grain settles {1e6 * numbers['mean_grain']:.3g} um; {numbers['cycles_computed']} of "
        f"40 cycles computed; error {100 * run['settlement_error']:+.1f} %"
    )
    ratio = f"{max(run['speed_up'], 1 / run['speed_up']):.1f} times "
    ratio += "dearer" if run["speed_up"] < 1 else "cheaper"
    record = read_run_record(finished)
    first = record.run.history.gain(0, 1, "loaded_body")
    assert record.control is not None
    full = record.control.history
    assert sleeper == (
        f"sleeper settles {1e6 * numbers['loaded_body']:.3g} um (one member, so no band) by cycle "
        f"40, {1e6 * first:.3g} um of it in the first; "
        f"stiffness {1e-6 * numbers['stiffness']:.3g} kN/mm "
        f"(full run: {1e-6 * full.late_mean('stiffness', 40):.3g}); {ratio}; error "
        f"{100 * run['loaded_body_error']:+.1f} %; full run: "
        f"{1e6 * full.gain(0, 40, 'loaded_body'):.3g} um"
    )
    assert main(["status", str(finished), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(
        json.dumps(make_plain(asdict(read_status(finished))))
    )
    empty = tmp_path / "run"
    shutil.copytree(finished, empty, ignore=shutil.ignore_patterns("window*", "jump*", "control"))
    assert main(["status", str(empty)]) == 0
    assert "settles" not in capsys.readouterr().out


def test_json_is_strict_and_says_what_was_run(finished: Path) -> None:
    """report.json has no NaN, the cycles of the run, and the definition S = T_full/T_procedure."""

    def refuse(name: str) -> None:
        raise AssertionError(name)

    numbers = json.loads((finished / "report.json").read_text(), parse_constant=refuse)
    assert (numbers["cycle"], numbers["total_cycles"], numbers["compared_at"]) == (40, 40, 40)
    spans = [(jump["first_cycle"], jump["last_cycle"]) for jump in numbers["jumps"]]
    assert numbers["cycles_computed"] == 40 - sum(last - first for first, last in spans)
    rows = {row["name"]: row for row in numbers["error_rows"]}
    run, nothing = rows["this run"], rows["jump and move nothing"]
    full = rows["full run (control)"]
    assert run["speed_up"] == pytest.approx(full["cpu_s"] / run["cpu_s"])
    # The fake engine settles by a ln(1 + N): moving nothing is wrong by what 40 - m cycles settle,
    # of what the full run gains since cycle 10, before the first jump.
    first = spans[0][0]
    exact = np.log((1 + numbers["cycles_computed"]) / 41) / np.log(41 / (1 + first))
    assert nothing["settlement_error"] == pytest.approx(exact, rel=1e-9)
    assert abs(run["settlement_error"]) < 0.02 < abs(exact)
    assert numbers["decks"] == {}
    assert numbers["engines"] == ["fake: fake 1"]


def test_page_is_self_contained(finished: Path) -> None:
    """The page is well-formed, loads nothing from anywhere, and forbids itself to.  The claim and
    where it fails come first, the command to make it again last."""
    page = (finished / "report.html").read_text(encoding="utf-8")
    tree = page_tree(page)
    for element in tree.iter():
        for name in ("src", "href", "srcset", "action", "data", "poster"):
            assert element.attrib.get(name, "data:").startswith("data:")
    assert not list(tree.iter("script"))
    assert "url(" not in page
    assert "@import" not in page
    policy = next(m for m in tree.iter("meta") if "http-equiv" in m.attrib)
    assert policy.attrib["content"].startswith("default-src 'none'")
    images = list(tree.iter("img"))
    assert all(image.attrib["alt"] for image in images)
    assert len(images) == len(list((finished / "figures").iterdir())) == 1
    assert (finished / "figures" / "settlement.png").read_bytes().startswith(b"\x89PNG")
    assert [heading.text for heading in tree.iter("h2")] == [
        "Settlement", "Error against speed-up", "Cost", "Jumps and relaxation", "Failures",
        "What the model leaves out", "Provenance", "Make it again",
    ]  # fmt: skip
    assert page.index('class="claim"') < page.index('class="fails"') < page.index("<h2>")
    command = "trackbed run scene.toml --run-folder ../again --control --set &#x27;engine.name="
    assert command in page


def test_figure_shows_every_cycle(finished: Path) -> None:
    """Both axes of cycles reach the last one, and settlement grows downwards from the first."""
    record = read_run_record(finished)
    assert record.control is not None
    spans = record.run.spans
    figure = draw_settlement(record.run.history, record.control.history, spans, "title")
    for panel in figure.axes:
        (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
        assert left <= 1 < 40 <= right < 80
        assert top <= 1e6 * record.run.history.loaded_body.min()
        assert bottom >= 1e6 * record.run.history.loaded_body.max()


@pytest.mark.engine("chromium")
@pytest.mark.long
def test_page_opens_in_a_browser(finished: Path, tmp_path: Path) -> None:
    """Chromium shows every image, writes nothing to its console and asks for nothing."""
    page = (finished / "report.html").read_text(encoding="utf-8")
    script = """<script>addEventListener("load", () => { document.title = JSON.stringify({
      widths: [...document.images].map(image => image.naturalWidth),
      asked: performance.getEntriesByType("resource").map(entry => entry.name)
        .filter(name => !name.startsWith("data:")),
      scrolls: document.documentElement.scrollWidth > innerWidth}); });</script>"""
    allowed = page.replace("style-src", "script-src 'unsafe-inline'; style-src")
    probe = tmp_path / "probe.html"
    probe.write_text(allowed.replace("</head>", script + "</head>"), encoding="utf-8")
    run = subprocess.run(
        [
            "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
            "--no-first-run", "--disable-background-networking", "--disable-component-update",
            "--disable-sync", f"--user-data-dir={tmp_path / 'browser'}", "--window-size=1000,800",
            "--enable-logging=stderr", "--dump-dom", probe.as_uri(),
        ],
        capture_output=True, text=True, timeout=120, check=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    title = re.search(r"<title>(.*?)</title>", run.stdout)
    assert title is not None
    seen = json.loads(title[1])
    assert len(seen["widths"]) == 1
    assert min(seen["widths"]) > 0
    assert seen["asked"] == []
    assert not seen["scrolls"]
    assert "CONSOLE" not in run.stderr


@pytest.mark.long
def test_report_changes_nothing_else_and_repeats_itself(finished: Path, copy: Path) -> None:
    """A report adds three things to the run folder, the same bytes each time and anywhere."""

    def files(folder: Path) -> dict[Path, bytes]:
        found = (path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder): path.read_bytes() for path in found}

    before = files(copy)
    write_report(copy)
    after = files(copy)
    assert {path.parts[0] for path in after.keys() - before.keys()} == {
        "report.html", "report.json", "figures",
    }  # fmt: skip
    assert {path: after[path] for path in before} == before
    assert after == files(finished)


def remove(folder: Path, *patterns: str) -> None:
    """Remove stages, then rewrite the table as the run does."""
    for pattern in patterns:
        for path in folder.glob(pattern):
            shutil.rmtree(path)
    RunFolder(folder).write_settlement()


def without_control(folder: Path) -> None:
    """The same run, started without --control."""
    shutil.rmtree(folder / "control")
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps(manifest | {"control": False}))


def after_the_first_jump(folder: Path) -> None:
    """Killed in the window after the first jump, before the control began."""
    remove(folder, "window_000015", "window_00002*", "jump_00002*", "window_00003*", "control")


def control_at_the_jump(folder: Path) -> None:
    """The control has linked the shared stages and computed none of its own."""
    remove(folder / "control", "window_00001[6-9]", "window_00002*", "window_00003*")
    remove(folder / "control", "window_000010")


def before_loading(folder: Path) -> None:
    """Killed in the first window."""
    remove(folder, "window_*", "jump_*", "control")


def before_the_end_of_the_rain(folder: Path) -> None:
    """Killed during the preparation."""
    remove(folder, "preparation", "window_*", "jump_*", "control")


def no_jumps(folder: Path) -> None:
    """Nothing but computed cycles: the control as a run of its own."""
    remove(folder, "preparation", "window_*", "jump_*")
    for path in (folder / "control").glob("*_*"):
        path.rename(folder / path.name)
    (folder / "control" / "preparation").rename(folder / "preparation")
    shutil.rmtree(folder / "control")
    RunFolder(folder).write_settlement()


@pytest.mark.parametrize(
    ("damage", "sentences"),
    [
        (without_control, ["The error is unknown", "--control</code> adds it", "at most"]),
        (after_the_first_jump, ["Unfinished, at cycle 15 of 40", "is not past"]),
        (control_at_the_jump, ["is not past the first jump yet"]),
        (before_loading, ["The bed is settled; no load cycle has been computed."]),
        (before_the_end_of_the_rain, ["The bed is not settled yet"]),
        (no_jumps, ["No jump was made.", "The error is unknown"]),
    ],
)
@pytest.mark.long
def test_report_of_a_part_of_a_run(
    damage: Callable[[Path], None], sentences: list[str], copy: Path
) -> None:
    """The report of an unfinished or lonely run is whole and says what is not known."""
    damage(copy)
    numbers, page = written(copy)
    page_tree(page)
    for sentence in sentences:
        assert sentence in page
    assert numbers["error_rows"] == []
    assert read_status(copy).cycle == numbers["cycle"]


@pytest.mark.long
def test_failed_jumps_are_named_counted_and_charged(finished: Path, copy: Path) -> None:
    """A jump that was given up is in the report with its reason, and its time in the cost."""
    before = report_of(finished)[0]
    name = "jump_000010_1"
    shutil.copytree(copy / name, copy / "jump_000010_2")
    record = json.loads((copy / name / "outcome.json").read_text())
    del record["seal"]  # it would tell that the record was changed
    record["cost"]["fit"] = 100.0
    (copy / name / "outcome.json").write_text(json.dumps(record))
    RunFolder(copy).give_up(name, "3 grains are lost: 4, 7, <12>")
    (copy / "discarded" / "window_000015.1").mkdir(parents=True, exist_ok=True)
    (copy / "discarded" / "window_000015.1" / "screen.txt").write_text("ERROR")
    after, page = written(copy)
    assert after["failed_jumps"] == [[name, "3 grains are lost: 4, 7, <12>"]]
    assert "3 grains are lost: 4, 7, &lt;12&gt;" in page
    assert "Failed attempts at a jump: 1; " in page
    assert "attempts at a jump that failed: 1" in page
    assert "window_000015.1" in after["discarded"]
    assert after["cycle"] == 40
    lost = after["costs"][0]["failed_jumps"]
    assert lost >= 100
    assert after["costs"][0]["total"] == pytest.approx(before["costs"][0]["total"] + lost)
    assert after["error_rows"][0]["speed_up"] < before["error_rows"][0]["speed_up"]


def test_scene_without_loading(tmp_path: Path) -> None:
    """A scene that is prepared and not loaded has a report of its preparation."""
    scene = tmp_path / "scene.toml"
    text = find_scene_file("karrech-coarse").read_text(encoding="utf-8")
    text = re.sub(r"\[loading\].*?(?=\[engine\])", "", text, flags=re.DOTALL)
    scene.write_text(text, encoding="utf-8")
    run_scene(scene, tmp_path / "run", overrides=SMALL[:2], progress=Progress(quiet=True))
    numbers, page = written(tmp_path / "run")
    assert numbers["finished"]
    assert RunFolder(tmp_path / "run").stage_names() == ["preparation"]
    assert "prepared and not loaded" in page
    assert "the scene names none" in page
    assert read_status(tmp_path / "run").state == "finished"
    assert read_status(tmp_path / "run").next.startswith("trackbed report ")


def test_status(copy: Path) -> None:
    """The status tells cycles, the report's speed-up and the next command; it notices a writer."""
    content = read_status(copy)
    assert (content.state, content.cycle, content.total_cycles) == ("finished", 40, 40)
    assert content.cycles_computed + content.cycles_jumped == 40
    rows = {row["name"]: row for row in written(copy)[0]["error_rows"]}
    run, full = rows["this run"], rows["full run (control)"]
    assert content.speed_up_so_far == run["speed_up"] == full["cpu_s"] / run["cpu_s"]
    assert content.control_cycle == 40
    with RunFolder(copy).lock():
        assert read_status(copy).state == "running"
    plain = make_plain(asdict(content))
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    remove(copy, "window_00003*", "window_00002*", "jump_00002*")
    RunFolder(copy).add_event("stopped", why="stopped by SIGTERM\n  -> go on")
    stopped = read_status(copy)
    assert (stopped.state, stopped.why) == ("stopped", "stopped by SIGTERM")
    assert stopped.next == f"trackbed resume {copy}"


@pytest.mark.long
def test_plotting_library_is_loaded_only_to_draw() -> None:
    """Importing the report's modules loads no matplotlib, and the status no numba."""
    code = (
        "import sys, adapters.procedure.status\n"
        "assert 'numba' not in sys.modules\n"
        "import adapters.report.page, adapters.report.figure\n"
        "assert 'matplotlib' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_numbers_are_typeset() -> None:
    """A number keeps its full value, has a real minus sign, and a dash when not known; powers of
    ten and per cents are as in print."""
    assert mark_number(None, "") == mark_number(float("nan"), "nan") == "\N{EN DASH}"
    assert mark_number(-0.5, "-0.5") == '<data value="-0.5">\N{MINUS SIGN}0.5</data>'
    assert mark_number(1.5, "1.5 <b>") == '<data value="1.5">1.5 &lt;b&gt;</data>'
    assert format_number(3.8e-7, ".1e").endswith(
        ">3.8 \N{MULTIPLICATION SIGN} 10<sup>\N{MINUS SIGN}7</sup></data>"
    )
    assert format_share(-0.0691).endswith(">\N{MINUS SIGN}6.9 %</data>")


def test_what_is_left_out_follows_from_the_scene() -> None:
    """Friction, mirrors, damping and jumps are named exactly where the scene has them."""

    def said(*overrides: str) -> str:
        return " ".join(list_omissions(load_scene(find_scene_file("karrech-coarse"), overrides)))

    text = said()
    assert "Elata and Berryman" in text
    assert "0.2145" in text
    assert "mirror" in text
    assert "law 'log'" in text
    smooth = said("material.grain.friction=0.0", "material.wall.friction=0.0")
    assert "Elata" not in smooth
    assert "Friction between grains: its coefficient is 0" in smooth
    assert "spin" not in smooth
    assert "mirror" not in said("sample.symmetry=[]")
    assert "no figure here is a result" in said('engine.name="fake"')
