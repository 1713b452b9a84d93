"""A form as a file: what ``trackbed stone`` writes of a mesh, and anyone may write by hand."""

import tomllib
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError

from adapters.bed.stones.form import Form
from adapters.errors import SceneError
from trackbed.run_files import write_whole
from trackbed.scene_files import Positive, Real, Table

HEAD = """\
# A stone for sample.form; written by trackbed stone.  Lengths in m, about the centre of mass along
# the principal axes; volume [m^3] and inertia, principal moments over the mass [m^2], are the
# stone's, not the spheres': x, y, z, radius of each.
"""


class Stone(Table):
    """What is in the file."""

    name: str  # for reports
    volume: Positive  # of the stone [m^3]
    inertia: Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]  # over mass [m^2]
    spheres: list[Annotated[tuple[Real, Real, Real, Positive], Field(strict=False)]]  # x y z r [m]


def write_form(form: Form, size: float, path: Path) -> None:
    """Write a form of a stone whose volume is that of a sphere of radius ``size`` [m]."""
    spheres, moments = np.column_stack([form.place, form.radius]), form.inertia * size**2
    text = f'name = "{form.name}"\nvolume = {4 / 3 * np.pi * float(size) ** 3!r}\n'
    text += f"inertia = {moments.tolist()!r}\nspheres = [\n"
    rows = (f"    {row!r},\n" for row in (size * spheres).tolist())
    write_whole(path, HEAD + text + "".join(rows) + "]\n")


def read_form(path: str) -> Form:
    """Read what `write_form` wrote; raises `SceneError` for what is no stone."""
    try:
        stone = Stone.model_validate(tomllib.loads(Path(path).read_text(encoding="utf-8")))
        if 2 * max(stone.inertia) > sum(stone.inertia) * (1 + 1e-9):
            raise ValueError("no body has a moment of inertia above the sum of the two others")
        if len(set(stone.spheres)) < max(len(stone.spheres), 1):
            raise ValueError("a sphere is given twice, or none")
    except (OSError, ValueError) as error:
        why = str(error)
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            why = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        raise SceneError(
            f"this is no stone: {why}", where=path, remedy="trackbed stone MESH writes one"
        ) from error
    size = np.cbrt(3 * stone.volume / (4 * np.pi))
    spheres = np.array(stone.spheres) / size
    return Form(stone.name, spheres[:, :3], spheres[:, 3], np.array(stone.inertia) / size**2)
