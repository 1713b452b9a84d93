"""Waves that meet the end of a bar or the side of a slab: what comes back, measured and derived."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import qdem_fem as q
from qdem_fem.mesh.generation import make_box_mesh

Floats = NDArray[np.float64]
GROUND = q.Material(200e6, 0.25, 2000.0)
PRESSURE = float(GROUND.lame_first + 2 * GROUND.lame_second)
SPEED = {
    "p": float(np.sqrt(PRESSURE / GROUND.density)),
    "s": float(np.sqrt(GROUND.lame_second / GROUND.density)),
}
"""c_p and c_s [m/s]."""


class Share(NamedTuple):
    """What became of a wave's energy when it had met the face, over what came."""

    left: float
    """In the body"""
    left_derived: float
    absorbed: float
    """By the dashpots"""
    absorbed_derived: float = np.nan


def bar(cells: int, size: float = 0.1, **options: Any) -> q.Simulation:
    """A row of so many cubes [m] along x, joined to its images across y and z: waves are plane."""
    mesh = make_box_mesh((cells * size, size, size), (cells, 1, 1), "kuhn")
    body = q.Body(mesh, GROUND, name="bar")
    run = q.Simulation([body], strain="small", threads=1, **options)
    for axis in (1, 2):
        x = body.nodes[:, axis]
        run.periodic(body, x < size / 2, x > size / 2)
    return run


def left_over(run: q.Simulation, came: float) -> float:
    """Kinetic and elastic energy, and that of the ground's springs, over ``came`` [J]."""
    energy = run.energy()
    return (energy.kinetic + energy.elastic + energy.foundation) / came


def bar_share(
    wave: str, depth: float | None = None, cells: int = 80, width: float = 5.0, end: str = "absorb"
) -> Share:
    """A pulse of ``width`` cells (a Gaussian's sigma) runs along a bar and meets its ``end``.

    It begins as the chain of planes that the bar is carries it, in one direction alone: of
    ``exp(i k x)``, ``sin(omega dt/2) = (c dt/h) sin(k h/2)``.  The end's equation of motion, with
    half a plane's mass, C and K, then gives for each k, with theta = k h/2 and phi = omega dt/2,

        R = (cos theta - Z)/(cos theta + Z),   Z = cos phi - i h/(2 H sin theta).

    Of the energy as it is counted, with velocities at the time of the displacements,
    ``2 cos^2 phi/(1 + cos^2 phi)`` is what the leapfrog keeps: so much can be absorbed.
    """
    run = bar(cells)
    body, size, c, dt = run.bodies[0], 0.1, SPEED[wave], run.step
    face = body.nodes[:, 0] > (cells - 0.5) * size
    if end == "absorb":
        run.absorb(body, face, depth)
        dt = run.step
    elif end == "fixed":
        run.fix(body, face)
    count = 4 * cells  # of the chain on a ring, for the transform
    k = 2 * np.pi * np.fft.fftfreq(count, size)
    theta = k * size / 2
    phi = np.arcsin(c * dt / size * np.sin(theta))
    x = size * np.arange(count)
    shape = np.fft.fft(np.exp(-(((x - 0.5 * cells * size) / (width * size)) ** 2) / 2))
    shape[count // 2] = 0.0
    component = 0 if wave == "p" else 1
    plane = np.rint(body.nodes[:, 0] / size).astype(int)
    for name, factor in (("displacement", 1.0), ("velocity", -1j * np.sin(2 * phi) / dt)):
        field = np.zeros_like(body.nodes)
        field[:, component] = 1e-6 * np.fft.ifft(shape * factor).real[plane]
        setattr(body, name, field)
    came = run.energy()
    run.advance(((0.5 * cells + 6 * width) * size + 16 * (depth or 0.0)) / c)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.cos(phi) - (0.0 if depth is None else 1j * size / (2 * depth * np.sin(theta)))
        back = np.abs((np.cos(theta) - z) / (np.cos(theta) + z)) ** 2
    elastic = (np.sin(theta) * np.abs(shape)) ** 2  # by k, of one scale
    back = np.where(elastic > 0, back, 0.0)
    whole = (elastic * (1 + np.cos(phi) ** 2)).sum()
    kept = 2 * elastic * np.cos(phi) ** 2
    start = came.kinetic + came.elastic
    return Share(
        left_over(run, start),
        float((elastic * (1 + np.cos(phi) ** 2) * back).sum() / whole),
        run.energy().absorbed / start,
        float((kept * (1 - back)).sum() / whole),
    )


def reflection(angle: float, poisson: float) -> tuple[complex, complex]:
    """Amplitudes of the p- and s-wave that dashpots on a plane send back of a p-wave.

    ``angle`` [rad] between the wave's way and the normal.  With displacements
    ``A d exp(i(k_x x + k_z z - omega t))`` the tractions of the three waves and of the dashpots
    balance in both directions (Lysmer and Kuhlemeyer 1969, with a = b = 1).
    """
    s = np.sqrt((1 - 2 * poisson) / (2 * (1 - poisson)))  # c_s/c_p
    p = np.array([np.sin(angle), np.cos(angle)])  # (k_x, k_z) over k_p
    t = np.array([p[0], np.sqrt(1 / s**2 - p[0] ** 2)])  # of the s-wave

    def traction(k: Any, d: Any) -> Any:
        """Stress on the plane less the dashpots', over i k_p (lambda + 2 mu): (x, z)."""
        shear = s**2 * (k[1] * d[0] + k[0] * d[1])
        normal = (1 - 2 * s**2) * (k @ d) + 2 * s**2 * k[1] * d[1]
        return np.array([shear - s * d[0], normal - d[1]])

    back = np.array([1, -1])
    turned = s * np.array([-t[1], -t[0]])  # displacement of the s-wave that goes back
    matrix = np.column_stack([traction(back * p, back * p), traction(back * t, turned)])
    found = np.linalg.solve(matrix, -traction(p, p))
    return complex(found[0]), complex(found[1])


def oblique_derived(angle: float, poisson: float) -> float:
    """Share of a p-wave's energy flow that dashpots send back, as p- and s-wave."""
    s = np.sqrt((1 - 2 * poisson) / (2 * (1 - poisson)))
    p, t = reflection(angle, poisson)
    slow = np.cos(np.arcsin(s * np.sin(angle)))
    return float(abs(p) ** 2 + abs(t) ** 2 * s * slow / np.cos(angle))


def oblique_share(degrees: float, cells: int = 24, length: float = 6.0) -> Share:
    """A packet of p-waves meets the face of a slab, ``degrees`` from its normal.

    The slab is joined across x, one wave's trace wide and ``cells`` cells, and across y; it is
    ``length`` times as deep as the packet's wavelength along z.
    """
    angle, poisson = np.radians(degrees), float(np.mean(GROUND.poisson))
    width = 1.0
    size = width / cells
    k_x = 2 * np.pi / width
    k_mean = k_x / np.tan(angle)
    layers = int(np.ceil(length * 2 * np.pi / k_mean / size))
    depth = layers * size
    mesh = make_box_mesh((width, size, depth), (cells, 1, layers), "kuhn")
    body = q.Body(mesh, GROUND, name="slab")
    run = q.Simulation([body], strain="small", threads=1)
    for axis, end in ((0, width), (1, size)):
        x = body.nodes[:, axis]
        run.periodic(body, x < size / 2, x > end - size / 2)
    run.absorb(body, body.nodes[:, 2] > depth - size / 2)
    sigma = 0.14 * depth
    k_z = k_mean + np.linspace(-4, 4, 161) / sigma
    weight = np.exp(-(((k_z - k_mean) * sigma) ** 2) / 2)
    k = np.hypot(k_x, k_z)
    u, v = np.zeros_like(body.nodes), np.zeros_like(body.nodes)
    x, z = body.nodes[:, 0], body.nodes[:, 2] - 0.45 * depth
    for amplitude, along, whole in zip(weight, k_z, k, strict=True):
        wave = amplitude * np.exp(1j * (k_x * x + along * z))
        way = np.array([k_x, 0.0, along]) / whole
        u += 1e-9 * np.real(wave)[:, None] * way
        v += 1e-9 * np.real(-1j * SPEED["p"] * whole * wave)[:, None] * way
    body.displacement, body.velocity = u, v
    came = run.energy()
    group = SPEED["p"] * k_mean / np.hypot(k_x, k_mean)
    run.advance((0.55 * depth + 4.5 * sigma) / group)
    met = k_z > 0  # what runs the other way never meets the face in this time
    flow = (weight * k) ** 2
    shares = [oblique_derived(np.arctan2(k_x, kz), poisson) if kz > 0 else 1.0 for kz in k_z]
    assert flow[~met].sum() < 1e-6 * flow.sum()
    derived = float((flow * shares).sum() / flow.sum())
    start = came.kinetic + came.elastic
    return Share(left_over(run, start), derived, run.energy().absorbed / start)
