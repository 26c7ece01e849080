"""The picture of y+ and Courant number on the OpenFOAM page: python docs/figures/openfoam_histograms.py.

Runs what is not on file in ``bench/histograms``: drift and sway of the bare SUBOFF hull on three meshes of the draft.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from towtank.craft.library import read_craft
from towtank.figures.walls import courant_of_meshes, y_plus_of_meshes
from towtank.grid.rans import rans_grid_study
from towtank.grid.show import table
from towtank.grid.study import GridStudy

WORK = Path(__file__).parents[2] / "bench" / "histograms"
RESOLUTIONS = (0.5, 0.75, 1.0)


def picture(study: GridStudy, path: Path) -> None:
    """y+ and Courant number on the meshes of ``study``, written to ``path``."""
    figure = Figure(figsize=(10.0, 3.1))
    FigureCanvasAgg(figure)
    y_plus_of_meshes(study, figure.add_axes((0.07, 0.17, 0.41, 0.65)))
    courant_of_meshes(study, figure.add_axes((0.57, 0.17, 0.41, 0.65)))
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    found = rans_grid_study(read_craft("suboff-bare"), WORK, resolutions=RESOLUTIONS)
    print(table(found))
    print(found.words)
    picture(found, Path(__file__).with_name("openfoam-histograms.png"))
