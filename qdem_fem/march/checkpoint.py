"""The state of a simulation in a file, from which it goes on to the same bits.

The file is an npz, readable by `numpy.load`; the comment of its archive is the SHA-256 of all
bytes before it, so that damage anywhere is seen before anything is believed.  Fields are in the
user's order of nodes and in the kernel's precision.
"""

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact import CriticalStep, Motion
from qdem_fem.files import CheckpointError, Series
from qdem_fem.march.state import State
from trackbed.run_files import write_whole

Arrays = dict[str, NDArray[Any]]

CHECKPOINT_FORMAT = 4
DIGEST = 64
"""Letters of a SHA-256 in hexadecimal."""
BESIDE = "beside "
"""Before the names of arrays that are not the simulation's."""


def write_checkpoint(
    simulation: State, path: str | Path, beside: Mapping[str, NDArray[Any]] | None = None
) -> None:
    """Write the state of ``simulation`` to ``path``; a kill leaves the old file or the new one.

    ``beside``: other arrays to be kept with it.
    """
    assembly, (_, held) = simulation.assembly, simulation.pack_lists()
    critical = simulation.elements_critical_step
    head = {
        "format": CHECKPOINT_FORMAT,
        "fingerprint": fingerprint_run(simulation),
        "motion": asdict(simulation.motion) | {"work": None},
        "critical_step": {
            field.name: getattr(critical, field.name)
            for field in fields(critical)
            if field.name != "mode"
        },
    }
    arrays: Arrays = {
        "head": np.array(json.dumps(head)),
        "work": simulation.motion.work,
        "previous": held.previous,
        "critical_mode": critical.mode,
    }
    arrays |= assembly.pack_state()
    if simulation.rigid is not None:
        arrays |= simulation.rigid.pack_state()
    if simulation.contacts is not None:
        arrays |= simulation.contacts.pack_state()
    arrays |= {f"{BESIDE}{name}": array for name, array in (beside or {}).items()}
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]  # numpy's stub takes them for its flags
    write_whole(Path(path), _seal_archive(stream.getvalue()))


def read_checkpoint(simulation: State, path: str | Path) -> Arrays:
    """Give ``simulation`` the state in ``path``; it then goes on as the one that was saved.

    Returns what was saved beside it.
    ``simulation`` is made as the saved one was: same meshes, materials, options and conditions
    (of conditions that are functions, only that they are).  Raises `CheckpointError` naming what
    differs, or that the file is damaged; the simulation is then as it was.
    """
    where = str(path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise CheckpointError(f"can not be read ({error.strerror})", where=where) from error
    head, arrays = _open_archive(content, where)
    _compare(head["fingerprint"], fingerprint_run(simulation), where)
    assembly, (_, held) = simulation.assembly, simulation.pack_lists()
    try:
        motion = Motion(**(head["motion"] | {"work": arrays["work"].copy()}))
        critical = CriticalStep(**head["critical_step"], mode=arrays["critical_mode"])
        previous = arrays["previous"]
        assembly.restore(arrays)
        if simulation.rigid is not None:
            simulation.rigid.restore(arrays)
        if simulation.contacts is not None:
            simulation.contacts.restore(arrays)
    except (KeyError, TypeError) as error:
        raise CheckpointError(f"a part of the state is not there ({error})", where=where) from error
    held.previous[:] = previous
    simulation.elements_critical_step = critical
    simulation.motion = motion
    return {
        name.removeprefix(BESIDE): array
        for name, array in arrays.items()
        if name.startswith(BESIDE)
    }


def fingerprint_run(simulation: State) -> dict[str, str]:
    """What makes a simulation this one and no other, by names a user knows."""
    conditions = simulation.conditions
    marks = {
        "bodies": ", ".join(body.name for body in simulation.bodies),
        "strain": simulation.strain,
        "precision": simulation.precision,
        "step": f"given, {simulation.given_step!r} s"
        if simulation.given_step is not None
        else f"{simulation.safety!r} of the critical one",
        "mass_scaling": repr(simulation.mass_scaling),
        "gravity": "none" if simulation.gravity is None else _hash_part(simulation.gravity),
        "loads": _hash_part(conditions.loads),
        "given displacements": _hash_part(conditions.held),
        "rollers": _hash_part(conditions.rollers),
        "periodic pairs": _hash_part(simulation.master),
    }
    if simulation.contact is not None:
        marks["contact"] = repr(simulation.contact)
        if simulation.contact.periodic is not None:
            marks["periodic width"] = repr(simulation.contact.periodic)
    for number, body in enumerate(simulation.bodies):
        if body.ELEMENT != "linear":
            marks[f"element of body {number}"] = body.ELEMENT
        marks[f"mesh of body {number}"] = _hash_part([body.nodes, body.elements])
        marks[f"material of body {number}"] = _hash_part(body.material)
        if body.rigid:
            marks[f"body {number} is rigid"] = str(body.rigid)
    return marks


def _hash_part(part: Any) -> str:
    """A hash of arrays, of lists and of what has fields; of a function, that it is one."""
    digest = hashlib.sha256()

    def add_part(part: Any) -> None:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str} {part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        elif callable(part) and not isinstance(part, Series):
            digest.update(b"a function")
        elif isinstance(part, list | tuple):
            digest.update(f"{len(part)} parts".encode())
            for each in part:
                add_part(each)
        elif hasattr(part, "__dict__"):
            add_part(list(vars(part).values()))
        else:
            digest.update(repr(part).encode())

    add_part(part)
    return digest.hexdigest()


def _compare(saved: Mapping[str, str], here: Mapping[str, str], where: str) -> None:
    different = [name for name in {**here, **saved} if saved.get(name) != here.get(name)]
    if not different:
        return
    name = different[0]
    both = [marks.get(name, "absent") for marks in (saved, here)]
    what = f"another simulation was saved: {', '.join(different)} differ"
    if all(len(text) < DIGEST for text in both):
        what += f" ({name}: {both[0]!r} in the file, {both[1]!r} here)"
    raise CheckpointError(
        what, where=where, remedy="make the simulation as it was when it was saved, or start again"
    )


def _seal_archive(archive: bytes) -> bytes:
    """The archive with its own hash as its comment; the length of that ends the archive."""
    body = archive[:-2] + DIGEST.to_bytes(2, "little")
    return body + hashlib.sha256(body).hexdigest().encode()


def _open_archive(content: bytes, where: str) -> tuple[dict[str, Any], Arrays]:
    """Head and arrays of a sound file."""
    body, seal = content[:-DIGEST], content[-DIGEST:]
    if hashlib.sha256(body).hexdigest().encode() != seal:
        raise CheckpointError(
            f"this is no whole checkpoint ({len(content)} bytes, and their checksum is wrong)",
            where=where, remedy="take an earlier checkpoint, or start again",
        )  # fmt: skip
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        head = json.loads(str(arrays["head"]))
        known = head["format"]
    except (KeyError, ValueError, OSError, EOFError) as error:
        raise CheckpointError(f"this is no checkpoint ({error})", where=where) from error
    if known != CHECKPOINT_FORMAT:
        raise CheckpointError(
            f"it is of format {known}, this version reads {CHECKPOINT_FORMAT}",
            where=where,
            remedy="go on with trackbed 0.1.0"
            if known == 3
            else "go on with the version that wrote it",
        )
    return head, arrays
