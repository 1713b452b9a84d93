"""The command trackbed: its verbs, exit codes and sentences, without an engine."""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

import trackbed
from adapters import errors
from trackbed.command import VERBS, explain_error, main
from trackbed.run_files import hold_signals, raise_on_signals

ROOT = Path(__file__).parents[2]


def command(*words: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "trackbed", *words],
        cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip


def test_help_names_every_verb_and_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    """``trackbed --help`` lists the verbs shipped, and every exit code an error can have."""
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    shipped = {"doctor", "new", "run", "resume", "status", "report", "export", "fit", "relax"}
    others = {"adopt", "sweep", "qdem", "grains", "train", "rigid", "line", "validate", "cite"}
    assert shipped | others | {"stone", "compare", "plot"} == set(VERBS)
    for verb in VERBS:
        assert f"\n    {verb}" in text
    codes = {
        kind.exit_code
        for kind in vars(errors).values()
        if isinstance(kind, type) and issubclass(kind, errors.TrackbedError)
    }
    for code in codes | {0, 1}:
        assert f"  {code}  " in text


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """``trackbed VERB --help`` exits 0 and shows the verb's usage."""
    with pytest.raises(SystemExit) as stop:
        main([verb, "--help"])
    assert stop.value.code == 0
    assert f"usage: trackbed {verb}" in capsys.readouterr().out


def test_help_loads_nothing_heavy() -> None:
    """The help of the command and of every verb starts without any of the big libraries; the
    version is there."""
    run = command("--version")
    assert (run.returncode, run.stdout) == (0, f"trackbed {trackbed.__version__}\n")
    code = (
        "import sys; from trackbed import command\n"
        "[command.build_parser(verb) for verb in command.VERBS]\n"
        "print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    heavy = {"numpy", "scipy", "numba", "pydantic", "matplotlib", "rich", "meshio", "pandas"}
    heavy |= {"dask", "distributed", "pyarrow", "skfem"}
    assert not heavy & set(run.stdout.split())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "required: VERB"),
        (["rnu"], "did you mean 'run'?"),
        (["zzzzzz"], "the verbs are doctor, new"),
        (["run"], "required: SCENE"),
        (["run", "scene.toml", "--contrl"], "unrecognized arguments: --contrl"),
        (["new", "karech", "x"], "did you mean karrech?"),
        (["validate", "no-such-case"], "no validation case"),
        (["run", "no-such-scene.toml"], "no-such-scene.toml"),
        (["sweep", "no-such-scene.toml", "--into", "x"], "no-such-scene.toml"),
        (["sweep", "no-such-scene.toml"], "required: --into"),
        (["run", "no-such-scene.toml", "--launcher", "mpirun 'x"], "--launcher"),
        *(([verb, "no-such-run"], "no-such-run") for verb in ("status", "resume", "report")),
        (["fit", "no-such-file.csv"], "no-such-file.csv"),
        (["grains", "--count", "9"], "required: --out"),
        (["grains", "--out", "no-such-folder/x.npz"], "no-such-folder"),
        (["train", "--out", "."], ". is a folder"),
    ],
)
@pytest.mark.long
def test_wrong_use(words: list[str], sentence: str, tmp_path: Path) -> None:
    """Wrong words end with exit code 2 and a sentence naming them, never a traceback."""
    run = command(*words, cwd=tmp_path)
    assert run.returncode == 2, run.stderr
    assert sentence in run.stderr
    assert "Traceback" not in run.stderr
    assert run.stdout == ""
    assert list(tmp_path.iterdir()) == []


def wrap(error: BaseException) -> BaseException:
    """An error that a Ctrl-C in compiled code is turned into."""
    error.__cause__ = errors.Interrupted("x")
    return error


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.SceneError("x"), 3),
        (errors.EngineMissing("x"), 4),
        (errors.EngineFailed("x"), 5),
        (errors.DumpError("x"), 6),
        (errors.NotConverged("x"), 7),
        (errors.SweepIncomplete("x"), 8),
        (errors.Interrupted("x"), 130),
        (KeyboardInterrupt(), 130),
        (PermissionError(13, "Permission denied", "there"), 2),
        (ModuleNotFoundError("No module named 'numba'", name="numba"), 4),
        (ImportError("cannot import name 'x'", name="adapters.laws.fit.prediction"), 1),
        (ZeroDivisionError("division by zero"), 1),
        (wrap(SystemError("a kernel returned a result with an exception set")), 130),
        (wrap(errors.UsageError("this is no whole file")), 130),
    ],
)
def test_exit_codes(error: BaseException, code: int, monkeypatch, capsys) -> None:
    """Every kind of error has its exit code; only an unknown one is called a bug."""

    def fails(_arguments: object) -> int:
        raise error

    monkeypatch.setattr("adapters.cli.start.run_cite", fails)
    assert main(["cite"]) == code
    text = capsys.readouterr().err
    assert text.startswith("trackbed: ")
    assert ("this is a bug" in text) == (code == 1)
    assert "Traceback" not in text
    assert main(["cite", "--debug"]) == main(["--debug", "cite"]) == code
    assert capsys.readouterr().err.count("Traceback") == 2


@pytest.mark.parametrize("begins", [True, False])
def test_an_interrupt_that_python_drops_ends_the_command(begins: bool, monkeypatch, capsys) -> None:
    """What is raised in a finaliser is printed and dropped: Ctrl-C there counts all the same."""
    after: list[str] = []
    before = signal.getsignal(signal.SIGINT)  # ignored in a job that a shell put behind

    def work(_arguments: object) -> int:
        with contextlib.suppress(KeyboardInterrupt):  # as Python itself does
            os.kill(os.getpid(), signal.SIGINT)
        if begins:
            with raise_on_signals("nothing", "again"):
                after.append("computed")
        return 0

    monkeypatch.setattr("adapters.cli.start.run_cite", work)
    assert main(["cite"]) == 130
    assert after == []
    assert "interrupted" in capsys.readouterr().err
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_is_held_until_the_block_ends() -> None:
    """What the block does is whole, and the signal counts behind it, after an error too."""
    done: list[str] = []

    def work(error: Exception | None) -> None:
        with raise_on_signals("nothing", "again"):
            with hold_signals():
                os.kill(os.getpid(), signal.SIGTERM)
                done.append("held")
                if error is not None:
                    raise error
            done.append("behind the block")

    for error in (None, ValueError("in the block")):
        with pytest.raises(errors.Interrupted, match="stopped by SIGTERM"):
            work(error)
    assert done == ["held", "held"]


def test_reader_goes_away() -> None:
    """``trackbed cite | true`` ends quietly."""
    run = subprocess.run(
        ["bash", "-o", "pipefail", "-c", f"{sys.executable} -m trackbed cite | true"],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (0, "")


def test_new_writes_the_shipped_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``new`` copies a scene byte for byte, says what to do next, and keeps what is there; its help
    names each scene."""
    folder = tmp_path / "deep" / "my bed"
    assert main(["new", "karrech", str(folder)]) == 0
    written = folder / "scene.toml"
    assert written.read_bytes() == (ROOT / "trackbed" / "scenes" / "karrech.toml").read_bytes()
    assert f"trackbed run '{written}'" in capsys.readouterr().out
    written.write_text("mine")
    assert main(["new", "karrech", str(folder)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert written.read_text() == "mine"
    with pytest.raises(SystemExit):
        main(["new", "--help"])
    text = capsys.readouterr().out
    for path in (ROOT / "trackbed" / "scenes").glob("*.toml"):
        assert path.stem in text


def test_run_hands_over_what_was_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``run`` passes scene, folder and overrides on; --engine and --launcher are overrides."""
    asked = {}

    def run_scene(scene: Path, run_folder: Path, **options: object) -> None:
        asked.update(options, scene=scene, run_folder=run_folder)

    monkeypatch.setattr("adapters.procedure.run.run_scene", run_scene)
    scene = tmp_path / "scene.toml"
    words = ["--control", "--set", "procedure.h=10", "--set", "sample.seed=2"]
    words += ["--engine", "fake", "--launcher", "mpirun -np '2'", "--dry-run"]
    assert main(["run", str(scene), *words]) == 0
    assert asked["scene"] == scene
    assert asked["run_folder"] == tmp_path / "run"
    assert asked["control"] is asked["dry_run"] is True
    assert asked["overrides"] == [
        "procedure.h=10",
        "sample.seed=2",
        'engine.name="fake"',
        'engine.launcher=["mpirun", "-np", "2"]',
    ]


def test_rows_left_out_before_a_load_change_still_tell_its_zero(tmp_path: Path) -> None:
    """10 m settle up to cycle 100, then 1e-3 N^0.45, whose future is uncertain; leaving out the
    earlier rows is no way round the refusal."""
    series = tmp_path / "series.csv"
    later = "".join(f"{100 + n},{10 + 1e-3 * n**0.45!r}\n" for n in range(1, 41))
    series.write_text("cycle,settlement\n1,9.9\n100,10\n" + later)
    words = ["fit", str(series), "--law", "auto", "--load-change", "100", "--to-cycle", "10000"]
    assert main(words) == main([*words, "--from-cycle", "101"]) == 6


def test_fit_restarts_at_a_load_change(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """3 ln N up to cycle 1000, then 5 ln of the cycles since: exact with the flag, and not without.

    From cycle 1000 on, but counted from the first one, the same rows are another curve.
    """
    first, second = range(1, 1001, 37), range(1, 1001, 37)
    rows = "".join(f"{n};{3 * math.log(n)!r}\n" for n in first)
    rows += "".join(f"{1000 + n};{20 + 5 * math.log(n)!r}\n" for n in second)
    series = tmp_path / "stages.txt"
    series.write_text("N;settlement [mm]\n" + rows)
    words = ["fit", str(series), "--law", "log", "--to-cycle", "11000", "--json"]
    found = {}
    for flag in ("--load-change", "--from-cycle"):
        assert main([*words, flag, "1000"]) == 0
        printed = capsys.readouterr()
        found[flag] = json.loads(printed.out)["prediction"]
        assert printed.err == ""
    expected = 20 + 5 * math.log(10000)
    assert found["--load-change"] == pytest.approx(expected, rel=1e-9)
    assert abs(found["--from-cycle"] - expected) > 10


@pytest.mark.parametrize(("law", "fewest"), [("auto", 4), ("log", 3)])
def test_fit_of_too_few_cycles_names_file_and_flags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], law: str, fewest: int
) -> None:
    """Of 12 rows 2 are left; without the flags nothing was left out, and nothing is said of it."""
    series, short = tmp_path / "series.csv", tmp_path / "short.csv"
    rows = [f"{n},{math.log(n)!r}\n" for n in range(1, 13)]
    series.write_text("cycle,settlement\n" + "".join(rows))
    short.write_text("cycle,settlement\n" + "".join(rows[:2]))
    for flags in (["--from-cycle", "11"], ["--from-cycle", "5", "--load-change", "10"]):
        assert main(["fit", str(series), "--law", law, "--to-cycle", "90", *flags]) == 2
        said = capsys.readouterr().err
        assert f"{series}: 2 cycles are too few" in said
        assert "10 earlier rows are left out" in said
        assert f"give at least {fewest} computed cycles, or leave fewer rows out" in said
    assert main(["fit", str(short), "--law", law]) == 2
    said = capsys.readouterr().err
    assert f"{short}: 2 cycles are too few" in said
    assert "left out" not in said


def test_cite_is_bibtex(capsys: pytest.CaptureFixture[str]) -> None:
    """``cite`` prints balanced BibTeX entries for methods, engine and trackbed itself."""
    assert main(["cite"]) == 0
    text = capsys.readouterr().out
    assert text.count("{") == text.count("}")
    for word in ("karrech2007", "10.1016/j.cma.2007.07.011", "nishiura2017", "schwager2002"):
        assert word in text
    assert f"version = {{{trackbed.__version__}}}" in text


@pytest.mark.long
def test_validate_lists_cases(capsys: pytest.CaptureFixture[str]) -> None:
    """``validate`` without a case lists the studies, and what measures now, with dashes; so does
    ``python -m validation``."""
    assert main(["validate"]) == 0
    home = ROOT / "validation"
    names = {path.parent.name for path in (home / "studies").glob("*/__init__.py")}
    names |= {path.stem for path in (home / "cases").glob("[!_]*.py")}
    text = capsys.readouterr().out
    assert text.split() == sorted(name.replace("_", "-") for name in names)
    module = [sys.executable, "-m", "validation"]
    assert subprocess.run(module, cwd=ROOT, capture_output=True, text=True).stdout == text


def test_a_study_is_judged_by_its_record(tmp_path, monkeypatch, capsys) -> None:
    """Rows of ``record.jsonl`` to the study's ``check_bars``; a line cut off by a kill is none."""
    from validation import studies, study

    folder = tmp_path / "my_study"
    folder.mkdir()
    (folder / "__init__.py").write_text('ROOMS = "adapters: laws"\n')
    (folder / "bars.py").write_text(
        "from validation.case import Check\ndef check_bars(rows):\n"
        "    return [Check('a', r['a'], '<= 2', r['a'] <= 2) for r in rows]\n"
    )
    rows = '{"part": "x", "a": 1.0}\n{"part": "y", "a": 3.0}\n{"a": 9'
    (folder / "record.jsonl").write_text(rows)
    monkeypatch.setattr(studies, "__path__", [str(tmp_path)])
    monkeypatch.setattr(study, "STUDIES", tmp_path)
    assert main(["validate", "my-study"]) == 6
    printed = capsys.readouterr()
    assert "1 of 2 checks do not hold" in printed.err
    assert "my-study: older than adapters.laws: x, y" in printed.out


@pytest.mark.parametrize(
    ("body", "code", "written"),
    [
        ("return [Check('a', 1.0, '<= 2', True, 'm')]", 0, [(1.0, True)]),
        ("return [Check('a', 1.0, '<= 2', True), Check('b', 3.0, '<= 2', False)]", 6,
         [(1.0, True), (3.0, False)]),
        ("return [Check('a', float('nan'), '<= 2', True)]", 6, [(None, False)]),
        ("return []", 6, []),
        ("raise NotConverged('no end')", 7, [(None, False)]),
    ],
)  # fmt: skip
def test_validate_record(
    body: str, code: int, written: list[tuple[float | None, bool]], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """The record holds every check; 0 only when all hold; NaN, nothing, an error never do.  One
    that cannot be written is refused before the case runs."""
    from validation import cases

    (tmp_path / "my_case.py").write_text(
        "from adapters.errors import NotConverged\nfrom validation.case import Check\n"
        f"def run(quick):\n    assert quick\n    {body}\n"
    )
    monkeypatch.setattr(cases, "__path__", [str(tmp_path)])
    monkeypatch.delitem(sys.modules, "validation.cases.my_case", raising=False)
    record = tmp_path / "record.json"
    nowhere = str(tmp_path / "no" / "f.json")  # without --quick the case would fail
    assert main(["validate", "my-case", "--json", nowhere]) == 2
    assert "does not exist" in capsys.readouterr().err
    assert main(["validate", "my-case", "--quick", "--json", str(record)]) == code
    content = json.loads(record.read_text())
    assert content["case"] == "my-case"
    assert [(check["value"], check["ok"]) for check in content["checks"]] == written
    assert all({"name", "bar", "unit"} <= set(check) for check in content["checks"])
    origin = content["provenance"]
    assert set(origin) == {"commit", "versions", "machine", "command", "started"}
    assert origin["command"] == "trackbed validate my-case --quick"
    assert origin["versions"]["numpy"]


def test_a_full_disk_has_one_exit_code(tmp_path: Path) -> None:
    """5 in all packages, and no other refusal to write has it."""
    from adapters.files.full_disk import explain_full_disk
    from trackbed.run_files.whole import refuse_writing

    def code(number: int, shown: Callable[[Path], AbstractContextManager[None]]) -> int:
        with pytest.raises(Exception, match=os.strerror(number)) as caught, shown(tmp_path):
            raise OSError(number, os.strerror(number))
        return explain_error(caught.value)[1]

    for number, wanted in (
        (errno.ENOSPC, 5), (errno.EDQUOT, 5), (errno.EFBIG, 5), (errno.EACCES, 2), (errno.EIO, 2)
    ):  # fmt: skip
        assert code(number, explain_full_disk) == wanted
        assert code(number, refuse_writing) == wanted
        assert explain_error(OSError(number, os.strerror(number)))[1] == wanted
