"""Page section: how far the loads depend on the mesh."""

from __future__ import annotations

from functools import partial

from towtank.figures import grid as figures
from towtank.grid.study import GridStudy, Quantity
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.of_rans import resolution_of_meshes
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study

TITLE = "Mesh study"
DRAWN = 3
"""Quantities drawn against mesh size: those with the largest bounds."""


def mesh(study: Study, book: Sketchbook) -> Section:
    """The choice in words, the worst quantities against mesh size, the bound of all, and the table."""
    it = study.grid
    if it is None:
        return Section("grid", TITLE, (missing("There is no mesh study.", STAGES["grid"]),))
    blocks: list[Block] = [Text(it.words, "good" if it.met else "bad"), _meshes(it)]
    calls = [partial(figures.convergence, it, name) for name in figures.notable(it, DRAWN)]
    if calls:
        words = "The steady and peak loads that the mesh leaves least certain, against mesh size."
        blocks.append(book.panels(calls, words, (2.3,), max(len(calls), 2)))
    words = "95 % bound of every quantity on the chosen mesh."
    blocks.append(book.draw(figures.bounds, it, caption=words))
    return Section("grid", TITLE, (*blocks, *resolution_of_meshes(it, book), _table(it)))


def _meshes(it: GridStudy) -> Table:
    rows = []
    for at, mesh in enumerate(it.meshes):
        shares = [item.share(at) for item in it.quantities]
        rows.append((
            mesh.label + (" (chosen)" if mesh.label == it.chosen else ""), str(mesh.cells),
            number(mesh.size / it.meshes[-1].size, 3), number(100.0 * max(shares), 2),
            str(sum(share <= it.target for share in shares)),
        ))  # fmt: skip
    head = ("Mesh", "Cells", "size over the finest", "largest bound [% of the load]",
            f"quantities within {100.0 * it.target:g} %")  # fmt: skip
    note = stated(it.level, f"bounds of 95 % of {len(it.quantities)} quantities", axes=False)
    return Table("Meshes", head, tuple(rows), note)


def _table(it: GridStudy) -> Table:
    at = it.number(it.chosen)
    rows = tuple(_row(item, at) for item in it.quantities)
    head = ("Run", "Load", "Measure", "Finest", "Extrapolated", "Unit", "Order", "GCI [%]", "Bound [%]", "Verdict")
    more = (
        f"GCI: of the finest mesh, share of its value. Bound: of mesh {it.chosen}, share of the load's root mean "
        "square (times 1.41 for harmonics; of a peak, itself). Measures over the last two periods; docs/grid.md"
    )
    return Table("Quantities on the meshes", head, rows, stated(it.level, "bounds of 95 %", more=more))


def _row(item: Quantity, at: int) -> tuple[str, ...]:
    it = item.estimate
    verdict = it.verdict + (", not asymptotic" if it.verdict == "monotone" and not it.in_range else "")
    return (
        item.run, item.load, item.measure, number(item.values[-1]), number(it.extrapolated),
        "N" if item.load in "XYZ" else "N m", number(it.order, 2), number(100.0 * it.gci, 2),
        number(100.0 * item.share(at), 2), verdict,
    )  # fmt: skip
