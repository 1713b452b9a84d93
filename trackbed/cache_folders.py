"""A folder for what numba and matplotlib keep, on a machine where they find none to write to."""

import atexit
import os
import shutil
import stat
import sys
import tempfile
from contextlib import suppress


def provide_cache_folders(package: str) -> None:
    """Name a private folder to numba and matplotlib where they could keep nothing.

    ``package`` is the folder of a package with kernels.  numba keeps a kernel beside its source
    or, where that can not be written to, in the user's cache; where neither can, as in a
    read-only installation used by someone without a home, it refuses to define the kernel at
    all.  Call this before the first kernel is defined.  matplotlib would look for all fonts at
    every start, and say so.  Raises `OSError` where there is no temporary folder either.
    """
    if not can_numba_write(package):
        folder = os.environ["NUMBA_CACHE_DIR"] = make_private_folder()
        if "numba" in sys.modules:  # it read the variable when it was imported
            sys.modules["numba"].config.CACHE_DIR = folder
    settings = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    settings = os.path.join(settings, "matplotlib")
    while not os.path.exists(settings):
        settings = os.path.dirname(settings) or "."
    if "MPLCONFIGDIR" not in os.environ and not can_write(settings):
        os.environ["MPLCONFIGDIR"] = os.path.join(make_private_folder(), "matplotlib")


def can_numba_write(package: str) -> bool:
    """Whether numba finds a place: the one it was given, beside all sources, the user's cache."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and can_write(given):
        return True
    sources = [folder for folder, _, files in os.walk(package) if "__init__.py" in files]
    if all(can_write(os.path.join(folder, "__pycache__")) for folder in sources):
        return True
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return can_write(os.path.join(home, "numba"))


def can_write(folder: str) -> bool:
    """Whether files can be made in a folder, which is made if need be; tried as numba tries it."""
    try:
        os.makedirs(folder, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def make_private_folder() -> str:
    """A folder in the temporary one that only this user can write to: kernels are programs.

    The same in every process; where someone else took its name another, removed at the end.
    """
    path = os.path.join(tempfile.gettempdir(), f"trackbed-cache-{os.getuid()}")
    with suppress(FileExistsError):
        os.mkdir(path, 0o700)
    found = os.lstat(path)
    own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    if own and not found.st_mode & 0o077:
        return path
    path = tempfile.mkdtemp(prefix="trackbed-cache-")
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path
