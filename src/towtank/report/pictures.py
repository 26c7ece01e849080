"""Drawing for the page: figures as SVG text with their own ids, the craft as GLB and as a still picture."""

from __future__ import annotations

import base64
import io
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towtank.craft.craft import Craft
from towtank.report.blocks import Picture, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.linewidth": 0.7,
    "axes.labelpad": 2.0,
    "xtick.bottom": False,
    "ytick.left": False,
    "figure.dpi": 72.0,
    "savefig.dpi": 150.0,
}
"""Held only while the report draws: text stays text, so a figure is small and can be searched."""

PAGE = 9.4
"""Width of the page's text [in] at the size figures are drawn."""

FONTS = "'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
_HEADER = re.compile(r"^.*?(?=<svg)", re.DOTALL)
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)
_IDS = re.compile(r"(\bid=\"|url\(#|href=\"#)")
_DECIMALS = re.compile(r"(?<![#\w])(-?\d+\.\d{2})\d+")


class Sketchbook:
    """Draws figures under one style and gives each SVG ids of its own, beginning with ``prefix``."""

    def __init__(self, prefix: str = "") -> None:
        self.prefix, self.count = prefix, 0

    def draw(self, function: Callable[..., Axes], *args: Any, caption: str, **options: Any) -> Picture:
        """Picture of ``function(*args, **options)``."""
        import matplotlib

        with matplotlib.rc_context(STYLE):
            return self._picture(function(*args, **options).get_figure(root=True), caption)

    def panels(
        self, calls: Sequence[Callable[..., Axes]], caption: str, heights: Sequence[float] = (2.5,), columns: int = 3
    ) -> Picture:
        """One wide picture: ``calls`` fill a grid of ``columns``, row by row; ``heights`` [in] of the rows' axes."""
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        width, above, below, side = PAGE, 0.66, 0.46, 0.78
        height = sum(heights) + len(heights) * (above + below)
        with matplotlib.rc_context(STYLE):
            figure = Figure(figsize=(width, height))
            FigureCanvasAgg(figure)
            top = height
            cell = width / columns
            for i, call in enumerate(calls):
                row, column = divmod(i, columns)
                if column == 0:
                    top -= above + heights[row] + (below if row else 0.0)
                box = (
                    (column * cell + side) / width,
                    top / height,
                    (cell - side - 0.08) / width,
                    heights[row] / height,
                )
                call(ax=figure.add_axes(box))
            return self._picture(figure, caption)

    def _picture(self, figure: Figure | None, caption: str) -> Picture:
        assert figure is not None
        self.count += 1
        share = round(min(100.0 * figure.get_figwidth() / PAGE, 100.0), 1)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
        return Picture(inline(text.getvalue(), f"{self.prefix}f{self.count}-"), caption, share)


def inline(svg: str, prefix: str) -> str:
    """SVG text fit for a page: no prologue, no metadata, ids made unique by ``prefix``, two decimals."""
    body = _METADATA.sub("", _HEADER.sub("", svg, count=1))
    body = _IDS.sub(lambda match: match.group(1) + prefix, body)
    body = body.replace("'DejaVu Sans'", FONTS)
    return _DECIMALS.sub(r"\1", body)


def view(craft: Craft) -> View:
    """The surface of ``craft``: GLB for the 3-D view and a still PNG for pages without WebGL, scripts, or on paper.

    Raises
    ------
    CraftError
        The surface cannot be built.
    """
    import matplotlib
    import trimesh
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from towtank.craft.solid import write_glb
    from towtank.figures.shape import shaded

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "craft.glb"
        write_glb(craft, path)
        glb = path.read_bytes()
        surface = trimesh.load_mesh(path)
    # glTF has y up, z forward, x to port.
    vertices = surface.vertices[:, [2, 0, 1]] * (1.0, -1.0, -1.0)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.5))
        FigureCanvasAgg(figure)
        shaded(vertices, surface.faces, figure.add_axes((0.02, 0.02, 0.96, 0.82)))
        still = io.BytesIO()
        figure.savefig(still, format="png", dpi=120, transparent=True)
    return View(
        base64.b64encode(glb).decode("ascii"),
        base64.b64encode(still.getvalue()).decode("ascii"),
        f"Hull of revolution fused with {len(craft.fins)} fins and {len(craft.strakes)} strakes. Geometry as given; no "
        "uncertainty stated.",
    )
