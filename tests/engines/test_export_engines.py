"""What an engine wrote opens in OVITO as it is; a run's export in all tools."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import GRAIN_ARRAYS, load_state
from adapters.files.states import read_state_file
from adapters.report.export.formats import export_run
from adapters.report.export.instants import read_exported_run
from tests.engine_sample import AFTER, SECOND, Sample

VECTORS = {"Particle Identifier", "Position", "Velocity", "Angular Velocity", "Radius", "Mass"}
"""Properties of OVITO that it makes of the columns of ``states.dump``."""


@pytest.mark.peer("ovito")
def test_dumps_open_in_ovito(sample: Sample) -> None:
    """Grains with the properties OVITO knows, the rain as a film, contacts as bonds."""
    from ovito.io import import_file
    from ovito.modifiers import LoadTrajectoryModifier

    folder = sample.run / "preparation"
    pipeline = import_file(str(folder / "states.dump"))
    contacts = LoadTrajectoryModifier()
    width = 12 if sample.scene.material.grain.friction else 6
    columns = ["Particle Identifiers.1", "Particle Identifiers.2", *(f"c{i}" for i in range(3))]
    columns += [f"d{i}" for i in range(width - 5)]
    contacts.source.load(str(folder / "contacts.dump"), columns=columns)
    pipeline.modifiers.append(contacts)
    data = pipeline.compute(pipeline.source.num_frames - 1)
    state = load_state(folder / "state.npz")
    assert set(data.particles.keys()) >= VECTORS
    # OVITO's reader of numbers is quick, and may be wrong in the last digit.
    np.testing.assert_allclose(data.particles.positions[...], state.position, rtol=1e-15)
    assert data.attributes["Timestep"] == state.time_step
    assert (data.particles.bonds.count if data.particles.bonds else 0) == len(state.contacts)
    rain = import_file(str(folder / "rain.dump"))
    assert rain.compute(0).particles.count == 40
    assert sample.name == "fake" or rain.source.num_frames > 10


@pytest.mark.peer("pyvista")
def test_export_opens(sample: Sample, tmp_path: Path) -> None:
    """Forces of contacts and places of grains are the engine's own, in VTK's reader."""
    import pyvista

    export_run(read_exported_run(sample.run), "vtu", tmp_path, every=5)
    state = sample.window(SECOND).state(-1)
    grains = pyvista.read(tmp_path / "vtu" / f"grains_{state.cycle:06d}.vtu")
    assert np.array_equal(grains.points, state.position)
    lines = pyvista.read(tmp_path / "vtu" / f"contacts_{state.cycle:06d}.vtu")
    assert lines.n_cells == len(state.contacts)
    if sample.name != "fake":
        push = np.linalg.norm(state.contacts.normal_force, axis=1)
        assert np.abs(lines["normal_force"]) == pytest.approx(push, rel=1e-9)
        assert np.mean(lines["normal_force"] > 0) > 0.8
        assert np.array_equal(lines["tangential_force"], state.contacts.tangential_force)


@pytest.mark.peer("h5py")
def test_states_are_exchanged(sample: Sample, tmp_path: Path) -> None:
    """Written as ON-DEM VTKHDF and read back, a state of each engine has all its digits."""
    *_, last = export_run(read_exported_run(sample.run), "vtkhdf", tmp_path, every=5)
    state, again = sample.window(AFTER).state(-1), read_state_file(last, 1.0)
    for name in GRAIN_ARRAYS:
        assert np.array_equal(getattr(again, name), getattr(state, name)), name
