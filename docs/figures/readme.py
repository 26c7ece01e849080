"""The picture of the README, from the study that `towtank run hokie` wrote: python docs/figures/readme.py hokie."""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from towtank.craft.solid import solid
from towtank.figures import forces, histories, shape, tracks
from towtank.report.study import read_study


def picture(folder: Path, path: Path) -> None:
    """Craft, yaw moment in drift, turning circle and spiral of the study in ``folder``, written to ``path``."""
    study = read_study(folder)
    assert study.craft is not None
    trials = {trial.kind: trial for trial in study.trajectories}
    figure = Figure(figsize=(11.0, 6.4))
    FigureCanvasAgg(figure)
    mesh = solid(study.craft)
    shape.shaded(mesh.vertices, mesh.faces, figure.add_axes((0.02, 0.52, 0.45, 0.38)))
    forces.load_against_angle(study.runs, "N", "drift", study.derivatives, figure.add_axes((0.56, 0.57, 0.42, 0.30)))
    tracks.turning_circle(trials["turning circle"], figure.add_axes((0.07, 0.08, 0.38, 0.33)))
    histories.spiral(trials["spiral"], figure.add_axes((0.56, 0.08, 0.42, 0.30)))
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    picture(Path(sys.argv[1]), Path(__file__).with_name("readme.png"))
