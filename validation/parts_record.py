"""A record of parts: a JSON line each, made again one by one."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from adapters.provenance import provenance
from adapters.run_folder import write_atomically

Row = dict[str, Any]


def parts_read(path: Path) -> dict[str, Row]:
    """The lines of a record by part."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return {line["part"]: line for line in map(json.loads, lines)}


def parts_measure(
    parts: Mapping[str, Callable[[], Row]],
    path: Path,
    module: str,
    about: str | None,
    words: Sequence[str] | None = None,
) -> None:
    """The command ``python -m module [--only PART ...]``: measure, and replace a part's line of the
    record at ``path`` as soon as the part is done.  ``about``: what ``--help`` says."""
    parser = argparse.ArgumentParser(description=about, allow_abbrev=False)
    parser.add_argument("--only", nargs="+", choices=parts, default=list(parts))
    for name in parser.parse_args(words).only:
        started = time.process_time()
        line = {"part": name, **parts[name]()}
        line["cpu_s"] = round(time.process_time() - started, 1)
        line["origin"] = provenance(["python", "-m", module, "--only", name])
        known = (parts_read(path) if path.exists() else {}) | {name: line}
        text = "".join(json.dumps(known[part]) + "\n" for part in parts if part in known)
        write_atomically(path, text)
        print(json.dumps(line), flush=True)
