"""Figures on grains, sleeper and loads of QDEM, for docs/ballast-grains.md.

    python -m validation.qdem_grains [--only PART ...]

Each part replaces its line of validation/results/qdem-grains.jsonl as soon as it is done; costs are
processor seconds.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from qdem_fem import Body, Material, Simulation
from qdem_fem.errors import MeshError
from qdem_fem.grain_form import GrainRecipe, corners_apart, grain_random, hull_faces
from qdem_fem.grain_grading import BALLAST, EN_13450_A, PAPER_SIZE, passing_of
from qdem_fem.grain_mesh import grain_faces, grain_tetrahedra, radius_ratios
from qdem_fem.grain_scan import Scan, scan_mesh, scan_thinned
from qdem_fem.grain_set import GrainSet, grains_load, grains_make, grains_save
from qdem_fem.grain_sieve import sieve_size
from qdem_fem.grain_surface import (
    faces_quartered,
    polyhedron_integrals,
    roundness_wadell,
    sphericity_true,
    surface_area,
    surface_edges,
)
from qdem_fem.load_train import Track, Train, seat_share, train_record, train_spectrum
from qdem_fem.mesh import TetMesh, element_gradients, mesh_read
from qdem_fem.sleeper_modes import free_modes
from validation.qdem_grains_sleeper import sleeper_part

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "qdem-grains.jsonl"
STONE = Material(young=30e9, poisson=0.2, density=2700)
"""Ballast, Table 1 of the paper, without its viscosity."""
VISCOUS_STONE = Material(young=30e9, poisson=0.2, density=2700, shear_viscosity=1e4)
PAPER_GRAINS, PAPER_TETRAHEDRA, PAPER_NODES = 5700, 622_591, 199_469
PAPER_LAYER = (4.6 + 3.0) / 2 * 0.4 * 0.6
"""Volume of the paper's ballast layer [m^3] (section 4)."""
Row = dict[str, Any]


def set_part(folder: Path) -> Row:
    """5,700 grains by one command: cost, size, quality, grading."""
    path = folder / "grains.npz"
    started = time.process_time()
    grains_save(path, grains_make(PAPER_GRAINS, 1))
    cost = time.process_time() - started
    grains = grains_load(path)
    worst, mass, surface = [], [], []
    for grain in range(len(grains)):
        mesh = grains.mesh(grain)
        worst.append(radius_ratios(mesh.nodes, mesh.elements).min())
        _, volumes = element_gradients(mesh.nodes, mesh.elements)
        solid = grains.solid(grain)
        mass.append(solid.volume)
        surface.append(abs(volumes.sum() / solid.volume - 1))
    masses = np.array(mass)
    return {
        "grains": len(grains), "cpu_s": cost, "bytes": path.stat().st_size,
        "tetrahedra": int(grains.tetrahedra.sum()), "nodes": len(grains.nodes),
        "radius_ratio": np.percentile(worst, [0, 5, 50, 95]).tolist(),
        "volume_error": max(surface), "mean_volume": float(masses.mean()),
        "mean_size": float(grains.sizes.mean()),
        "mean_size_by_mass": float((grains.sizes * masses).sum() / masses.sum()),
        "sieves": EN_13450_A.sieves.tolist(), "asked": BALLAST.passing.tolist(),
        "got": passing_of(grains.sizes, masses, EN_13450_A.sieves).tolist(),
        "least": EN_13450_A.least.tolist(), "most": EN_13450_A.most.tolist(),
        "between": float(np.diff(passing_of(grains.sizes, masses, np.array([0.0315, 0.05])))[0]),
        "sphericity": np.percentile(grains.sphericity, [0, 50, 100]).tolist(),
        "roundness": np.percentile(grains.roundness, [0, 50, 100]).tolist(),
        "shape_factor": float((masses / grains.sizes**3).mean()),
        "paper_size_volume": float(
            (masses / grains.sizes**3).mean() * PAPER_SIZE.sieves.mean() ** 3
        ),
    }  # fmt: skip


def control_part(folder: Path) -> Row:
    """Asked against achieved shape over a grid, measured anew on the saved nodes."""
    rows = []
    for psi in (0.72, 0.77, 0.82, 0.87):
        for roundness in (0.62, 0.66, 0.70, 0.74, 0.78, 0.82):
            recipe = GrainRecipe(psi, 0.0, roundness, 0.0)
            got: list[tuple[float, float]] = []
            refused = 0
            for grain in range(8):
                try:
                    form = grain_random(np.random.default_rng([7, grain]), recipe)
                except MeshError:
                    refused += 1
                    continue
                faces = grain_faces(form.corner_faces)
                surface = form.nodes[: faces.max() + 1]
                volume = polyhedron_integrals(surface, faces).volume
                got.append(
                    (sphericity_true(volume, surface_area(surface, faces)),
                     roundness_wadell(surface, faces))
                )  # fmt: skip
            rows.append({"sphericity": psi, "roundness": roundness, "refused": refused,
                         "got": got})  # fmt: skip
    return {"rows": rows}


def shapes_part(folder: Path) -> Row:
    """Closed forms: sphericity, roundness against mesh size, sieve size."""
    golden = (1 + np.sqrt(5)) / 2
    icosahedron = np.array([[0, i, j * golden] for i in (-1, 1) for j in (-1, 1)])
    icosahedron /= np.sqrt(1 + golden**2)
    solids = {
        "sphere": np.vstack([np.roll(icosahedron, shift, axis=1) for shift in range(3)]),
        "cube": np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], float),
        "tetrahedron": np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
    }
    rows = {}
    for name, nodes in solids.items():
        faces, levels = hull_faces(nodes), []
        for _ in range(6):
            volume = polyhedron_integrals(nodes, faces).volume
            psi = sphericity_true(volume, surface_area(nodes, faces))
            levels.append((len(faces), psi, roundness_wadell(nodes, faces)))
            edges = surface_edges(faces)
            nodes = np.vstack([nodes, nodes[edges.nodes].mean(axis=1)])
            if name == "sphere":
                nodes /= np.linalg.norm(nodes, axis=1)[:, None]
            faces = faces_quartered(faces, edges)
        rows[name] = {"levels": levels, "sieve": sieve_size(solids[name])}
    return rows | {"sieve_gap": sieve_gaps(40)}


def sieve_gaps(count: int) -> list[float]:
    """How far `sieve_size` of each of ``count`` grains is above the least of 12 turned copies, for
    which the search starts elsewhere."""
    gaps = []
    quaternions = np.random.default_rng(0).standard_normal((12, 4))
    turns = Rotation.from_quat(quaternions).as_matrix()
    for grain in range(count):
        nodes = grain_random(np.random.default_rng([3, grain]), GrainRecipe()).nodes
        gaps.append(sieve_size(nodes) / min(sieve_size(nodes @ turn) for turn in turns) - 1)
    return np.percentile(gaps, [50, 95, 100]).tolist()


def tetrahedra_halved(mesh: TetMesh) -> TetMesh:
    """Each tetrahedron cut into eight at the middles of its edges, the octahedron that is left
    along its shortest diagonal (Bey 1995); same polyhedron."""
    t = mesh.elements
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    every = np.sort(np.concatenate([t[:, pair] for pair in pairs]), axis=1)
    edges, place = np.unique(every, axis=0, return_inverse=True)
    nodes = np.vstack([mesh.nodes, mesh.nodes[edges].mean(axis=1)])
    middles = len(mesh.nodes) + place.reshape(6, -1)
    ab, ac, ad, bc, bd, cd = middles
    a, b, c, d = t.T
    corners = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
    # a diagonal, then the four middles around it
    rings = [(ab, cd, ac, ad, bd, bc), (ac, bd, ab, ad, cd, bc), (ad, bc, ab, ac, cd, bd)]
    length = [np.linalg.norm(nodes[one] - nodes[other], axis=1) for one, other, *_ in rings]
    chosen = np.stack(rings)[np.argmin(length, axis=0), :, np.arange(len(t))].T
    one, other, *ring = chosen
    inner = [(one, other, ring[k], ring[(k + 1) % 4]) for k in range(4)]
    return mesh_read((nodes, np.concatenate([np.stack(x, axis=1) for x in corners + inner])))


def critical_step(mesh: TetMesh, stone: Material = STONE) -> float:
    """`qdem_fem`'s own critical step of a free grain [s]."""
    return Simulation([Body(mesh, stone)]).critical_step.value


def stiffness_part(folder: Path) -> Row:
    """Lowest free frequencies of grains, against quadratic elements on a finer mesh, and steps."""
    rows = []
    for grain in range(3):
        form = grain_random(np.random.default_rng([11, grain]), GrainRecipe())
        nodes = form.nodes * 0.05 / sieve_size(form.nodes)
        mesh = grain_tetrahedra(nodes, form.corner_faces)
        halved = tetrahedra_halved(mesh)
        surface = Scan(nodes[mesh.node_sets["surface"]], grain_faces(form.corner_faces))
        meshes = {"as made": mesh, "halved": halved, "halved twice": tetrahedra_halved(halved),
                  "gmsh, same surface": scan_mesh(surface)}  # fmt: skip
        exact = free_modes(halved, STONE, 4, quadratic=True).frequency
        coarse = free_modes(mesh, STONE, 4, quadratic=True).frequency
        for name, one in meshes.items():
            started = time.process_time()
            frequency = free_modes(one, STONE, 4).frequency
            rows.append({
                "grain": grain, "mesh": name, "tetrahedra": len(one.elements),
                "nodes": len(one.nodes), "error": (frequency / exact - 1).tolist(),
                "reference_error": float(np.abs(coarse / exact - 1).max()),
                "first": float(exact[0]), "step": critical_step(one),
                "radius_ratio": float(radius_ratios(one.nodes, one.elements).min()),
                "cpu_s": time.process_time() - started,
            })  # fmt: skip
    return {"rows": rows}


def scan_part(folder: Path) -> Row:
    """A bumpy stone of 3,584 triangles thinned out: what shape, inertia and sieve size lose."""
    nodes = corners_apart(np.random.default_rng(0), 9)
    faces = hull_faces(nodes)
    for _ in range(4):
        edges = surface_edges(faces)
        nodes = np.vstack([nodes, nodes[edges.nodes].mean(axis=1)])
        faces = faces_quartered(faces, edges)
    bumps = 1 + 0.15 * np.sin(3 * nodes[:, 0]) * np.cos(4 * nodes[:, 1])
    away = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    whole = Scan((nodes + away) / 2 * bumps[:, None] * [0.03, 0.025, 0.02], faces)
    exact = np.linalg.eigvalsh(polyhedron_integrals(whole.nodes, whole.faces).inertia)
    size = sieve_size(whole.nodes)
    rows = []
    for count in (30, 50, 100, 200, 400, 800):
        thin = scan_thinned(whole, count)
        mesh = scan_mesh(thin)
        inertia = np.linalg.eigvalsh(polyhedron_integrals(thin.nodes, thin.faces).inertia)
        rows.append({
            "triangles": len(thin.faces), "tetrahedra": len(mesh.elements),
            "inertia_error": float(np.abs(inertia / exact - 1).max()),
            "sieve_error": sieve_size(thin.nodes) / size - 1,
            "sphericity": thin.sphericity, "roundness": thin.roundness,
            "radius_ratio": float(radius_ratios(mesh.nodes, mesh.elements).min()),
            "step": critical_step(mesh),
        })  # fmt: skip
    return {"rows": rows, "triangles": len(whole.faces), "sphericity": whole.sphericity}


def steps_part(folder: Path) -> Row:
    """Critical steps of random grains of the 5,700, by `qdem_fem` itself."""
    grains: GrainSet = grains_make(60, 1)
    steps = [critical_step(grains.mesh(grain)) for grain in range(len(grains))]
    viscous = [critical_step(grains.mesh(grain), VISCOUS_STONE) for grain in range(len(grains))]
    scaled = np.array(steps) / grains.sizes
    return {
        "grains": len(steps), "step": np.percentile(steps, [0, 5, 50, 95]).tolist(),
        "viscous": np.percentile(viscous, [0, 5, 50, 95]).tolist(),
        "step_at_5_cm": (0.05 * np.percentile(scaled, [0, 5, 50, 95])).tolist(),
    }  # fmt: skip


def load_part(folder: Path) -> Row:
    """The made-up train: shares, impulse, peaks of its spectrum."""
    train, track, area = Train(), Track(), 0.13 * 0.17
    record = train_record(train, track, area)
    impulse = trapezoid(record.pressure[:, 0], record.time) * area
    exact = 4 * train.cars * train.first_share * train.axle_load * track.spacing / train.speed
    frequency = np.linspace(0, 60, 6001)
    size = np.abs(train_spectrum(frequency, train, track))
    peak = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])) + 1
    peak = peak[np.argsort(-size[peak])][:8]
    return {
        "elastic_length": track.elastic_length, "share": float(seat_share(np.zeros(1), track)[0]),
        "least_share": float(seat_share(np.linspace(0, 6, 2001), track).min()),
        "greatest": float(record.pressure.max()), "least": float(record.pressure.min()),
        "duration": float(record.time[-1]), "impulse_error": float(impulse / exact - 1),
        "car_frequency": train.speed / train.car_length,
        "peaks": sorted((float(frequency[p]), float(size[p])) for p in peak),
    }  # fmt: skip


PARTS: dict[str, Callable[[Path], Row]] = {
    "shapes": shapes_part,
    "control": control_part,
    "set": set_part,
    "stiffness": stiffness_part,
    "steps": steps_part,
    "scan": scan_part,
    "sleeper": sleeper_part,
    "load": load_part,
}


def record_read(path: Path = RECORD) -> dict[str, Row]:
    """The parts recorded so far."""
    if not path.exists():
        return {}
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {line["part"]: line for line in lines}


def main(words: Sequence[str] | None = None) -> None:
    """Measure parts and record them."""
    parser = argparse.ArgumentParser(description="Measures grains, sleeper and loads of QDEM.")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    given = parser.parse_args(words)
    for name in given.only:
        started = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            found = PARTS[name](Path(folder))
        line = {"part": name, "part_cpu_s": time.process_time() - started} | found
        line["origin"] = provenance(["python", "-m", "validation.qdem_grains", "--only", name])
        lines = record_read() | {name: line}
        text = "".join(json.dumps(lines[part]) + "\n" for part in PARTS if part in lines)
        write_atomically(RECORD, text)
        print(name, f"{line['part_cpu_s']:.1f} s")


if __name__ == "__main__":
    main()
