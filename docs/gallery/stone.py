"""Stones from a scan

A closed surface of triangles, and the spheres that stand for it in a simulation: they have its
volume and its moments of inertia.
"""

import sys

import numpy as np
from matplotlib import pyplot
from scipy.spatial import ConvexHull

from adapters.bed.stones import pack_spheres
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
random = np.random.default_rng(4)
points = random.normal(size=(60, 3))
points *= [0.03, 0.02, 0.018] / np.linalg.norm(points, axis=1, keepdims=True)  # m
hull = ConvexHull(points)
outwards = np.einsum("ij,ij->i", np.cross(*np.diff(points[hull.simplices], axis=1).swapaxes(0, 1)),
                     hull.equations[:, :3]) > 0  # fmt: skip
triangles = np.where(outwards[:, None], hull.simplices, hull.simplices[:, ::-1])

figure = pyplot.figure(figsize=(9, 2.6))
scan, *stones = figure.subplots(1, 4, subplot_kw={"projection": "3d"})
scan.plot_trisurf(*(1e3 * points.T), triangles=triangles, color="#c9b79c", edgecolor="0.4", lw=0.3)
scan.set_title("scan")
azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0, np.pi, 13))
unit = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)])
for axes, count in zip(stones, (3, 8, 20), strict=True):
    form, size, fits = pack_spheres("stone", points, triangles.astype(np.int64), count)
    for place, radius in zip(form.place, form.radius, strict=True):
        axes.plot_surface(*(1e3 * size * (place[:, None, None] + radius * unit)), color="#c9b79c")
    axes.set_title(f"{count} spheres, inertia {fits[-1].inertia_error:.1%} off", fontsize=8)
for axes in (scan, *stones):
    axes.set(xlim=(-30, 30), ylim=(-30, 30), zlim=(-30, 30))
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.set_axis_off()
figure.savefig(sys.argv[1])
