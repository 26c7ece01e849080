"""The picture of the OpenFOAM mesh page: python docs/figures/openfoam_mesh.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from towtank.craft.library import read_craft
from towtank.frames import Array
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.mesh.poly import PolyMesh

CRAFT = read_craft("suboff-x")
SETTINGS = MeshSettings(along=80, around=24, out=36)
STEEL, FIN, LINE = (0.55, 0.65, 0.75), (0.85, 0.60, 0.40), (0.25, 0.30, 0.35)


def quads(mesh: PolyMesh, name: str) -> Array:
    """Corners (n, 4, 3) of the faces of a patch."""
    patch = mesh.patch(name)
    return mesh.points[mesh.faces[patch.start : patch.start + patch.count]]


def shaded(mesh: PolyMesh, forward: Array, centre: Array, reach: tuple[float, float], axes: Axes) -> None:
    """Hull and fins seen along ``forward`` around ``centre``, ``reach`` wide and high [m]; the farthest faces first."""
    forward = forward / np.linalg.norm(forward)
    right = np.cross([0.0, 0.0, 1.0], forward)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    faces = [(quads(mesh, p.name), STEEL if p.name == "hull" else FIN) for p in mesh.patches if p.kind == "wall"]
    corners = np.concatenate([q for q, _ in faces]) - centre
    colour = np.concatenate([np.tile(c, (len(q), 1)) for q, c in faces])
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    light = 0.5 + 0.5 * np.clip(normal @ (0.6 * forward + 0.7 * down + 0.4 * right), 0.0, 1.0)
    seen = normal @ forward > 0.0  # faces of a wall look out of the water, into the craft
    order = np.argsort(-(corners.mean(axis=1) @ forward)[seen])
    flat = np.stack([corners @ right, -(corners @ down)], axis=-1)[seen][order]
    shade = np.clip(colour * light[:, None], 0.0, 1.0)[seen][order]
    axes.add_collection(PolyCollection(flat, facecolors=shade, edgecolors=LINE, linewidths=0.25))
    axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]), aspect="equal")
    axes.axis("off")


def plane(mesh: PolyMesh, axes: Axes) -> None:
    """Lines of the symmetry plane."""
    corners = quads(mesh, "symmetry")[:, :, :2]
    edges = np.concatenate([corners[:, [a, (a + 1) % 4]] for a in range(4)])
    axes.add_collection(LineCollection(edges, colors=[LINE], linewidths=0.3))
    axes.set_aspect("equal")


def picture(path: Path) -> None:
    """Nose with its cap, stern with turned fins, and the plane of a half domain, written to ``path``."""
    figure = Figure(figsize=(11.0, 7.0))
    FigureCanvasAgg(figure)
    turned = mesh_of(CRAFT, SETTINGS, half=False, fins=np.radians([20.0, 20.0, -20.0, -20.0]))
    bare = mesh_of(CRAFT, SETTINGS, half=True)
    nose, stern = figure.add_axes((0.01, 0.47, 0.36, 0.5)), figure.add_axes((0.38, 0.47, 0.61, 0.5))
    at_nose = np.array([CRAFT.origin_from_nose, 0.0, 0.0])
    at_stern = at_nose - [CRAFT.fins[0].trailing_edge - 0.05, 0.0, 0.0]
    shaded(turned, np.array([-0.9, 0.3, 0.3]), at_nose, (0.27, 0.25), nose)
    shaded(turned, np.array([0.62, 0.6, 0.5]), at_stern, (0.5, 0.41), stern)
    nose.set_title("nose: butterfly cap", fontsize=10)
    stern.set_title("stern: fins turned by 20 deg", fontsize=10)
    whole, close = figure.add_axes((0.05, 0.06, 0.38, 0.36)), figure.add_axes((0.52, 0.06, 0.45, 0.36))
    for axes in (whole, close):
        plane(bare, axes)
        axes.set_xlabel("x [m]", fontsize=9)
        axes.tick_params(labelsize=8)
    whole.set(xlim=(-14.0, 14.0), ylim=(-11.5, 11.5))
    whole.set_title("plane of symmetry", fontsize=10)
    close.set(xlim=(-2.6, -1.2), ylim=(-0.45, 0.45))
    close.set_title("the same at the tail", fontsize=10)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    picture(Path(__file__).with_name("openfoam-mesh.png"))
