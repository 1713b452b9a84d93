"""Ctrl-C from the first line of the command on: exit code 130 and no traceback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from trackbed.command import main

pytestmark = pytest.mark.lowest

SENDS = """
import builtins, os, runpy, signal, sys
load = builtins.__import__
def send(name, *others, **named):
    if name == "{module}":
        os.kill(os.getpid(), signal.SIGINT)
    return load(name, *others, **named)
builtins.__import__ = send
sys.argv = ["trackbed", "cite"]
runpy.run_module("trackbed", run_name="__main__")
"""
LOST = """
import sys
import adapters.cli.start
from trackbed.__main__ import start
class Dropped:
    def __del__(self):
        import os, signal
        os.kill(os.getpid(), signal.SIGINT)
def run(_):
    Dropped()
    exec("raise KeyboardInterrupt")
adapters.cli.start.run_cite = run
sys.argv = ["trackbed", "cite"]
sys.exit(start())
"""


@pytest.mark.parametrize(
    "script",
    [SENDS.format(module=name) for name in ("trackbed.command", "argparse", "trackbed.scenes")]
    + [LOST],
)
def test_an_interrupt_at_the_start_ends_the_command(script: str, tmp_path: Path) -> None:
    """At imports, and where Python drops it or takes it for one that nobody caught."""
    (tmp_path / "begin.py").write_text(script)  # a module: as such Python looks at what is lost
    done = subprocess.run(
        [sys.executable, "-m", "begin"], capture_output=True, text=True, check=False, cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "trackbed: interrupted\n"


def test_a_folder_is_no_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is the one that we are in, which has no name."""
    monkeypatch.chdir(tmp_path)
    assert main(["rigid", "."]) == 2
