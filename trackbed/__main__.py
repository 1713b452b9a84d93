"""The command ``trackbed``, also as ``python -m trackbed``: Ctrl-C counts before anything loads."""

import os
import signal
import sys


def start() -> int:
    """Run the command of `sys.argv`; its exit code, 130 where Ctrl-C ends its imports."""
    signal.signal(signal.SIGINT, end_at_once)
    # `main` takes notice of a Ctrl-C that Python drops
    sys.unraisablehook = lambda e: e.exc_type is KeyboardInterrupt or sys.__unraisablehook__(e)
    from trackbed.command import main

    code = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done, and the code says of what
    exec("")  # else Python ends by a signal where Ctrl-C came in an exec, as of a dataclass
    return code


def end_at_once(_number: int, _frame: object) -> None:
    """End without a traceback: what is raised in an import is wrapped, or dropped, on its way."""
    os.write(sys.stderr.fileno(), b"trackbed: interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(start())
