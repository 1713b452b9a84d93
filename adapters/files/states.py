"""States in files: ``.npz`` of trackbed, ``.vtkhdf`` of ON-DEM, a text dump of an engine, a run."""

from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, State, load_state, save_state
from adapters.errors import DumpError, UsageError
from adapters.files.dump import EXTENSIONS, PACKED, Frame, write_dump
from adapters.files.dump_reader import read_last_frame
from adapters.files.ondem import ENDING, write_bodies
from adapters.files.run_folder import RunFolder
from adapters.files.window import load_window
from trackbed.run_files import refuse_links


def read_state_file(path: Path, density: float) -> State:
    """A state from ``path``: ``.npz`` as `adapters.bed.load_state`, a run folder by
    `read_last_state`, else by `read_last_frame`.

    A dump needs the columns id, radius and places.  Without its own columns, a mass is that of a
    sphere of ``density`` [kg/m^3] and a velocity is zero; contacts and piston it has none.
    Raises `UsageError` and `DumpError`.
    """
    if path.is_dir() and RunFolder(path).stage_names():
        return read_last_state(path)
    if path.name == "states.npz" and (path.parent / "outcome.json").exists():
        raise UsageError(
            "this holds the ends of many cycles, not one state", where=str(path),
            remedy="give the run folder: its last state is taken",
        )  # fmt: skip
    if path.suffix == ".npz" and path.is_file():
        return load_state(path)
    frame = read_last_frame(path)
    try:
        radius, place = frame.column("radius"), frame.find_centres()
    except DumpError as error:
        raise error.relocate(f"{path}, {error.where}") from None

    def read_vectors(*columns: str) -> FloatArray:
        there = set(columns) <= set(frame.columns)
        return frame.block(*columns) if there else np.zeros((len(radius), 3))

    return State(
        frame.column("id").astype(np.int64), place, radius,
        frame.column("mass") if "mass" in frame.columns else density * 4 / 3 * np.pi * radius**3,
        read_vectors("vx", "vy", "vz"), read_vectors("omegax", "omegay", "omegaz"),
        time_step=frame.time_step,
    )  # fmt: skip


def read_last_state(run: Path) -> State:
    """The bed at the end of the last finished stage of a run; raises `UsageError` for none."""
    refuse_links(run)
    folder = RunFolder(run)
    for name in reversed(folder.stage_names()):
        if folder.outcome(name) is not None and not folder.failure(name):
            if name.startswith("window"):
                return load_window(run / name / "states.npz").state(-1)
            return load_state(run / name / f"{'relaxed' if name[0] == 'j' else 'state'}.npz")
    raise UsageError(
        "no stage of a run is finished here", where=str(run), remedy="give a run folder, or a file"
    )


def check_state_name(path: Path) -> None:
    """Raise `UsageError` for the name of another kind of file."""
    kept = path.with_suffix("") if path.suffix in PACKED else path
    known = kept.suffix in (*EXTENSIONS, ".npz", "") or kept.suffix[1:].isdecimal()
    if not known and path.suffix != ENDING:
        raise UsageError(
            f"a state is no {path.suffix} file", where=str(path),
            remedy=f"name it .npz, or {', '.join(EXTENSIONS)} for a dump, or {ENDING}",
        )  # fmt: skip


def write_state_file(state: State, path: Path) -> None:
    """Write a state to ``path``: ``.npz`` whole and without loss, else its grains alone.

    Raises `UsageError` as `check_state_name`.
    """
    check_state_name(path)
    if path.suffix == ".npz":
        save_state(state, path)
        return
    if path.suffix == ENDING:
        write_bodies(path, state, {"iteration": state.time_step}, {}, {})
        return
    columns = ("id", *"xyz", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass")
    values = np.column_stack(
        [state.identifier, state.position, state.velocity, state.spin, state.radius, state.mass]
    )
    reach = state.radius[:, None]
    bounds = np.column_stack(
        [(state.position - reach).min(axis=0), (state.position + reach).max(axis=0)]
    )
    write_dump(path, [Frame(state.time_step, columns, values, bounds)])
