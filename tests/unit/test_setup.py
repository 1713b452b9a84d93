"""setup.sh on machines that lack things: it says what and stops, or installs only what lacks."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COREUTILS = ("cat", "cksum", "dirname", "env", "mktemp", "rm", "sh", "tail")


class Machine:
    """A clone of the project and a PATH that holds only what a test puts there."""

    def __init__(self, folder: Path) -> None:
        self.clone, self.bin, self.calls = folder / "clone", folder / "bin", folder / "calls"
        self.clone.mkdir()
        self.bin.mkdir()
        for name in ("setup.sh", "pyproject.toml"):
            shutil.copy(ROOT / name, self.clone)
        for name in COREUTILS:
            (self.bin / name).symlink_to(str(shutil.which(name)))
        self.program("id", "echo 0")
        self.program("liggghts", "exit 1")
        self.program("python3", PYTHON)

    def program(self, name: str, text: str) -> None:
        """A program that notes its call, then does ``text``."""
        path = self.bin / name
        path.write_text(f'#!/bin/sh\necho "{name} $*" >>{self.calls}\n{text}\n')
        path.chmod(0o755)

    def lacks(self, name: str) -> None:
        """Take a program away."""
        (self.bin / name).unlink()

    def setup(self, *extras: str) -> subprocess.CompletedProcess[str]:
        """Run setup.sh."""
        return subprocess.run(
            ["./setup.sh", *extras], cwd=self.clone, env={"PATH": str(self.bin)},
            stdin=subprocess.DEVNULL, capture_output=True, text=True,
        )  # fmt: skip

    def called(self) -> str:
        """All calls noted since the last look."""
        text = self.calls.read_text() if self.calls.exists() else ""
        self.calls.unlink(missing_ok=True)
        return text


PYTHON = f"""\
case "$*" in
  "-m venv"*) for word; do folder=$word; done
     {shutil.which("mkdir")} -p "$folder/bin"
     {shutil.which("cp")} "$0" "$folder/bin/python" ;;
  "-m pip"*) exit 0 ;;
  *) exec {sys.executable} "$@" ;;
esac"""
"""A Python whose environments and pip cost nothing."""


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    """A machine that has everything but apt-get and sudo, as root."""
    return Machine(tmp_path)


def test_second_call_installs_nothing(machine: Machine) -> None:
    """With all in place the second call runs neither pip nor apt-get."""
    first = machine.setup()
    assert first.returncode == 0, first.stderr
    assert "installing Python packages into .venv, 600 MB: trackbed and" in first.stdout
    assert "-m pip install" in machine.called()
    second = machine.setup()
    assert (second.returncode, second.stdout) == (0, "")
    assert "-m" not in machine.called()


@pytest.mark.parametrize("change", ["extras", "pyproject", "moved"])
def test_set_up_again_when_needed(machine: Machine, change: str) -> None:
    """Other extras, a changed pyproject.toml or a moved clone install again."""
    machine.setup()
    machine.called()
    if change == "pyproject":
        with (machine.clone / "pyproject.toml").open("a") as stream:
            stream.write("\n")
    if change == "moved":
        machine.clone = machine.clone.rename(machine.clone.with_name("moved"))
    machine.setup(*["lint"] * (change == "extras"))
    called = machine.called()
    assert "-m pip install" in called
    assert ("-e .[lint]" in called) == (change == "extras")


def no_apt(machine: Machine) -> None:
    machine.lacks("liggghts")


def no_root_no_sudo(machine: Machine) -> None:
    machine.lacks("liggghts")
    machine.program("id", "echo 1000")
    machine.program("apt-get", "")


def apt_fails(machine: Machine) -> None:
    machine.lacks("liggghts")
    machine.program("apt-get", 'echo "E: Unable to locate package liggghts"; exit 100')


def old_python(machine: Machine) -> None:
    machine.program("python3", 'case "$1" in --version) echo Python 3.9.2 ;; *) exit 1 ;; esac')


def pip_fails(machine: Machine) -> None:
    failing = PYTHON.replace('"-m pip"*) exit 0', '"-m pip"*) echo "no network" >&2; exit 1')
    machine.program("python3", failing)


@pytest.mark.parametrize(
    ("lacking", "said"),
    [
        (no_apt, ["missing here: liggghts", "no apt-get"]),
        (no_root_no_sudo, ["needs root", "apt-get install liggghts"]),
        (apt_fails, ["E: Unable to locate package liggghts", "could not install liggghts"]),
        (old_python, ["Python 3.9.2 is too old", "PYTHON="]),
        (pip_fails, ["no network", "is the network there?"]),
    ],
)
def test_what_stops_it(
    machine: Machine, lacking: Callable[[Machine], None], said: list[str]
) -> None:
    """What is missing and the way out in a sentence, exit code 4, and so again the next time."""
    lacking(machine)
    for _ in range(2):
        run = machine.setup()
        assert run.returncode == 4
        for words in said:
            assert words in run.stderr
    assert ("apt-get" in machine.called()) == (lacking is apt_fails)


def test_sudo_is_used(machine: Machine) -> None:
    """A user with sudo installs through it, and no password is asked for without a terminal."""
    machine.lacks("liggghts")
    machine.program("id", "echo 1000")
    machine.program("apt-get", "")
    machine.program("sudo", 'shift; exec "$@"')
    run = machine.setup()
    assert run.returncode == 0, run.stderr
    called = machine.called()
    assert "sudo -n env DEBIAN_FRONTEND=noninteractive apt-get install" in called
    assert "installing with sudo -n apt-get: liggghts" in run.stdout


def test_chromium_only_for_all_tests(machine: Machine) -> None:
    """The browser is installed for ``make test-all``, not for the demo and ``make test``."""
    machine.program("apt-get", "")
    machine.setup()
    machine.setup("test")
    assert "apt-get" not in machine.called()
    machine.setup("test,peers")
    assert "--no-install-recommends chromium" in machine.called()


def test_unreachable_source_does_not_stop(machine: Machine) -> None:
    """A failing ``apt-get update`` is reported, and the installation tried all the same."""
    machine.lacks("liggghts")
    machine.program("apt-get", '[ "$1" != update ] || { echo "E: no such source"; exit 100; }')
    run = machine.setup()
    assert run.returncode == 0
    assert "E: no such source" in run.stderr


def test_python_without_venv(machine: Machine) -> None:
    """A Python without ensurepip, as Debian's is when bare, gets python3-venv."""
    machine.program("apt-get", "")
    machine.program(
        "python3", f'case "$*" in *ensurepip*) exit 1 ;; esac\n{PYTHON}'
    )  # the import of ensurepip fails
    machine.setup()
    assert "--no-install-recommends python3-venv" in machine.called()
