"""A grid study as plain text."""

from __future__ import annotations

import math

from towtank.grid.study import GridStudy, Quantity

HEAD = ("run", "load", "measure", "finest", "extrapolated", "order", "GCI %", "bound %", "verdict")
UNITS = (
    "Values in N and N m. bound %: 95 % bound on the chosen mesh over the size of the load in the run\n"
    "(its root mean square, for harmonics times 1.41; for a peak itself).\n"
    "GCI %: of the finest mesh; on more than three meshes the bound of the least-squares fit in its place."
)


def table(study: GridStudy) -> str:
    """Meshes, a row for each quantity, and the choice in words."""
    mesh = study.number(study.chosen)
    rows = [HEAD, *(_row(item, mesh) for item in study.quantities)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEAD))]
    lines = ["  ".join(_placed(row[i], widths[i], i) for i in range(len(HEAD))).rstrip() for row in rows]
    meshes = ", ".join(f"{item.label} ({item.cells} cells)" for item in study.meshes)
    return "\n".join(
        [f"Grid study of {study.craft}, level {study.level}", f"Meshes, coarse to fine: {meshes}", "", lines[0],
         "-" * len(lines[0]), *lines[1:], "", UNITS]
    )  # fmt: skip


def _placed(text: str, width: int, column: int) -> str:
    return text.rjust(width) if 3 <= column <= 7 else text.ljust(width)


def _row(item: Quantity, mesh: int) -> tuple[str, ...]:
    it = item.estimate
    return (
        item.run, item.load, item.measure, f"{item.values[-1]:.5g}", _number(it.extrapolated, ".5g"),
        _number(it.order, ".2f"), _number(100.0 * it.gci, ".2g"), f"{100.0 * item.share(mesh):.2g}",
        it.verdict if it.in_range else f"{it.verdict}, not asymptotic" if it.verdict == "monotone" else it.verdict,
    )  # fmt: skip


def _number(value: float, digits: str) -> str:
    return format(value, digits) if math.isfinite(value) else "-"
