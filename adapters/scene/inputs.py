"""Files that a scene names, as a run folder keeps them."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from adapters.bed import find_sample_mass, save_state
from adapters.scene.ballast import read_stored_bed
from adapters.scene.tables import Scene

INPUT_FILES = ("scene.toml", "load_series.csv", "form.toml", "bed.npz")
"""Names of the copies."""


def copy_inputs(scene: Scene, scene_path: Path, folder: Path) -> Iterator[str]:
    """Copy the scene file and all that it names; yields overrides that name the copies."""
    shutil.copyfile(scene_path, folder / "scene.toml")
    if scene.loading is not None and scene.loading.series is not None:
        shutil.copyfile(scene.loading.series, folder / "load_series.csv")
        yield 'loading.series="load_series.csv"'
    if (form := str(scene.sample.form)).endswith(".toml"):
        shutil.copyfile(form, folder / "form.toml")
        yield 'sample.form="form.toml"'
    if scene.sample.state is not None:
        bed = read_stored_bed(scene.sample.state)
        mass = find_sample_mass(bed.radius, scene.material.grain.density)
        save_state(replace(bed, mass=mass), folder / "bed.npz")
        yield 'sample.state="bed.npz"'


def record_scene(scene: Scene) -> dict[str, Any]:
    """The effective parameters of a scene, as the manifest keeps them; a load series as values,
    a saved bed as a digest of its grains."""
    record = scene.model_dump(mode="json")
    if scene.loading is not None and scene.loading.samples is not None:
        record["loading"]["series"] = {
            name: values.tolist() for name, values in vars(scene.loading.samples).items()
        }
    if str(scene.sample.form).endswith(".toml"):
        record["sample"]["form"] = {
            name: getattr(scene.form, name).tolist() for name in ("place", "radius", "inertia")
        }
    if scene.sample.state is not None:
        bed = read_stored_bed(scene.sample.state)
        grains = bed.position.tobytes() + bed.radius.tobytes()
        record["sample"]["state"] = sha256(grains).hexdigest()
    return record
