"""The verb ``stone``: a form for stones from a mesh, by spheres packed into it."""

import argparse
from pathlib import Path

from adapters.errors import UsageError

UNITS = ("m", "cm", "mm")
"""Of lengths in meshes; those of scenes, `LengthUnit`, would load pydantic for ``--help``."""
SPHERES_MOST = 200
"""Spheres of a stone at most: a bed of such stones costs as much as one of meshes."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``stone`` to its parser."""
    parser.add_argument(
        "mesh", metavar="MESH", type=Path, help="closed surface of triangles: STL, OBJ, PLY, ..."
    )
    parser.add_argument("--unit", required=True, choices=UNITS, help="of the mesh's lengths")
    parser.add_argument(
        "--spheres", metavar="N", type=int, default=8, help="spheres of the stone (default: 8)"
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path,
        help="form to write, for sample.form of a scene (default: the mesh's name .toml, here)",
    )  # fmt: skip
    parser.set_defaults(command=run_stone)


def run_stone(arguments: argparse.Namespace) -> int:
    """Pack spheres into a mesh, print how well they stand for it, and write the form."""
    import numpy as np

    from adapters.bed.stones import pack_spheres, write_form
    from trackbed.mesh_file import read_mesh_file
    from trackbed.series_file import SI

    out = arguments.out or Path(arguments.mesh.stem + ".toml")
    if out.suffix != ".toml" or out.exists() or not 1 <= arguments.spheres <= SPHERES_MOST:
        what = f"--out is a .toml that is not there yet, and --spheres 1 to {SPHERES_MOST}"
        raise UsageError(what, where=str(out), remedy="name another file, or other spheres")
    mesh = read_mesh_file(arguments.mesh, str(arguments.mesh))
    triangles = mesh.cells_dict.get("triangle", np.empty((0, 3), np.int64))
    points = SI[arguments.unit] * mesh.points.astype(float)
    try:
        form, size, fits = pack_spheres(
            arguments.mesh.stem, points, triangles.astype(np.int64), arguments.spheres
        )
    except UsageError as error:
        raise error.relocate(str(arguments.mesh)) from None
    write_form(form, size, out)
    volume = 4 / 3 * np.pi * size**3
    print(f"{arguments.mesh}: volume {volume:.4g} m^3, that of a sphere of {size:.4g} m")
    print("spheres  volume inside  radii grown by  inertia then")
    for n, *errors in (vars(fit).values() for fit in fits):
        print("{:7}  {:+13.1%}  {:14.1%}  {:12.1%}".format(n, *errors))
    print("errors of the spheres inside, and of moments when radii are grown to the mesh's volume")
    print(f"next: in a scene [sample] form = {str(out)!r}; mass and inertia are the mesh's")
    return 0
