"""The study: the same runs on three or more meshes, judged quantity by quantity, and the mesh to use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.grid.estimate import LEAST_MESHES, Estimate, check_sizes, estimate
from towtank.grid.gather import Mesh, matched
from towtank.grid.quantities import HARMONICS, NEGLIGIBLE, PEAK, THIRD, considerable, measures, root_mean_square
from towtank.provenance import provenance
from towtank.symbols import FOURFOLD_TIES, LOADS
from towtank.tank.run import Run

TARGET = 0.02
"""Default bound that a mesh must keep, as a share of the size of the load in the run (judgement: half of it is the
standard uncertainty, which then adds little to a fit whose weights end at 1 %)."""
COVERAGE = 2.0
"""The index is a bound of about 95 %, so the standard uncertainty is half of it (jcgm100, k = 2)."""
TWINS = {"heave": "sway", "pitch": "yaw", "incidence": "drift"}
"""Kind -> the kind of the other plane, which tells the same for a craft with 4-fold symmetry."""


@dataclass(frozen=True)
class Quantity:
    """One number on every mesh, coarse to fine.

    run, kind : of the run.   load : X ... N.   measure : steady, mean, peak, in phase, quadrature, third.
    values : [N, N m].   scale : size of the load that the bound is compared with, on the finest mesh [N, N m]: root
        mean square over the run, times the root of 2 for harmonics; of a peak, itself.
    """

    run: str
    kind: str
    load: str
    measure: str
    values: tuple[float, ...]
    scale: float
    estimate: Estimate

    @property
    def name(self) -> str:
        """``<run> <load> <measure>``: the key in grid.json."""
        return f"{self.run} {self.load} {self.measure}"

    def share(self, mesh: int) -> float:
        """95 % bound on mesh number ``mesh``, as a share of ``scale``."""
        return float(self.estimate.uncertainty[mesh]) / self.scale


@dataclass(frozen=True)
class GridStudy:
    """Meshes coarse to fine, every quantity judged, and the mesh chosen.

    chosen : label of the coarsest mesh on which every quantity keeps ``target``; the finest when none does.
    met : whether one does.   words : the choice in words.   symmetry : of the craft.
    """

    craft: str
    level: str
    symmetry: str
    meshes: tuple[Mesh, ...]
    quantities: tuple[Quantity, ...]
    target: float
    chosen: str
    met: bool
    words: str
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def number(self, label: str) -> int:
        """Place of a mesh, coarse to fine.

        Raises
        ------
        InputError
            No mesh of that label.
        """
        labels = [mesh.label for mesh in self.meshes]
        if label not in labels:
            raise InputError(f"grid: no mesh {label!r}. The study holds {', '.join(labels)}; name one of them.")
        return labels.index(label)

    def share(self, kind: str, load: str, label: str | None = None) -> float | None:
        """Standard discretisation uncertainty of ``load`` in runs of ``kind``, over the load's root mean square.

        Parameters
        ----------
        kind, load : "sway", "Y" and the like.   label : of the mesh; the chosen one by default.

        Returns
        -------
        The largest over the runs of that kind, half of the 95 % bound (k = 2). In an oscillation the bounds of mean
        and harmonics add as squares. None when the study says nothing about that load in that kind. With 4-fold
        symmetry a vertical run that was not studied takes the numbers of its horizontal twin.

        Source     jcgm100 for the coverage factor.
        """
        mesh = self.number(self.chosen if label is None else label)
        found = self._shares(kind, load, mesh)
        if not found and self.symmetry == "fourfold" and kind in TWINS:
            found = self._shares(TWINS[kind], _twin_load(load), mesh)
        return max(found) / COVERAGE if found else None

    def _shares(self, kind: str, load: str, mesh: int) -> list[float]:
        """Root mean square error over root mean square of the load, of each run; of a peak where nothing else is."""
        squares: dict[str, float] = {}
        peaks: dict[str, float] = {}
        for item in self.quantities:
            if (item.kind, item.load) == (kind, load):
                kept = peaks if item.measure == PEAK else squares
                kept[item.run] = kept.get(item.run, 0.0) + item.share(mesh) ** 2
        return [float(np.sqrt(square)) for square in (squares or peaks).values()]


def _twin_load(load: str) -> str:
    """The load of the horizontal plane that stands for one of the vertical plane."""
    return {name[0]: base[0] for name, (base, _) in FOURFOLD_TIES.items()}.get(load, load)


def grid_study(sets: Sequence[Sequence[Run]], *, target: float = TARGET) -> GridStudy:
    """Judge runs that were made on three or more meshes.

    Parameters
    ----------
    sets : the runs of each mesh; the same names in each. ``run.provenance["mesh"]`` gives ``label`` and ``cells``
        (and ``dimensions``, 3 unless it says otherwise); meshes are put in order by their cells.
    target : 95 % bound that the chosen mesh keeps, as a share of the size of the load.

    Returns
    -------
    GridStudy: steady loads; mean, peak and harmonics of oscillations over their last two periods.

    Raises
    ------
    InputError
        Fewer than three meshes, a run without its mesh, meshes that are too alike, runs of other names, motions,
        craft or speeds, or a target that is not above zero.

    Source     celik2008, eca2014, ittc75030101: see ``estimate``.
    Valid      Meshes that are alike, refined everywhere by the same ratio; loads converged in time and iteration.
    """
    check_target(target)
    meshes, rows = matched(sets)
    sizes = np.array([mesh.size for mesh in meshes])
    check_sizes(sizes)
    quantities = tuple(item for row in rows for item in _judged(row, sizes))
    if not quantities:
        raise InputError("grid: no run holds a load that differs from zero. Give runs with drift, turns or motions.")
    chosen, met, words = _choice(meshes, quantities, target)
    first = rows[0][0]
    levels = sorted({run.level for row in rows for run in row})
    known = provenance(
        {f"{mesh.label}/{run.name}": run.id for row in rows for mesh, run in zip(meshes, row, strict=True)},
        **_distributions(meshes, rows),
    )
    return GridStudy(
        first.craft, " + ".join(levels), first.symmetry, meshes, quantities, target, chosen, met, words, known
    )


def _distributions(meshes: Sequence[Mesh], rows: Sequence[Sequence[Run]]) -> dict[str, Any]:
    """What the runs carry of y+ and Courant number, by mesh and run; nothing where none carries it."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        for mesh, run in zip(meshes, row, strict=True):
            health = run.provenance.get("health", {})
            if isinstance(health, Mapping) and health.get("distribution"):
                found.setdefault(mesh.label, {})[run.name] = health["distribution"]
    return {"distribution": found} if found else {}


def check_target(target: float) -> None:
    """Refuse a bound that is not a share of a load."""
    if not 0.0 < target < 1.0:
        raise InputError(f"grid: target {target:g} is not a share of a load between 0 and 1. 0.02 asks for 2 %.")


def _judged(row: Sequence[Run], sizes: np.ndarray) -> list[Quantity]:
    """Quantities of one run on all meshes; which loads count is decided on the finest."""
    finest = row[-1]
    kept = considerable(finest)
    size = dict(zip(LOADS, (float(x) for x in root_mean_square(finest)), strict=True))
    found = [measures(run) for run in row]
    return [
        Quantity(
            finest.name, finest.kind, load, measure, values := tuple(item[load, measure] for item in found),
            _scale(measure, value, size[load]), estimate(np.array(values), sizes),
        )
        for (load, measure), value in found[-1].items()
        if load in kept and (measure != THIRD or value > NEGLIGIBLE * size[load])
    ]  # fmt: skip


def _scale(measure: str, value: float, size: float) -> float:
    """What the bound of a measure is compared with; ``size`` is the root mean square of its load."""
    return abs(value) if measure == PEAK else np.sqrt(2.0) * size if measure in HARMONICS else size


def _choice(meshes: Sequence[Mesh], quantities: Sequence[Quantity], target: float) -> tuple[str, bool, str]:
    """Label of the chosen mesh, whether it keeps the target, and why in words."""
    worst = [max(quantities, key=lambda item, i=i: item.share(i)) for i in range(len(meshes))]  # type: ignore[misc]
    kept = [item.share(i) <= target for i, item in enumerate(worst)]
    # A mesh counts only when all finer ones keep the target too: one lucky coarse mesh is no convergence.
    first = next((i for i in range(len(meshes)) if all(kept[i:])), len(meshes) - 1)
    outside = [item for item in quantities if not item.estimate.in_range]
    range_words = (
        f"{len(quantities) - len(outside)} of {len(quantities)} quantities are in the asymptotic range on the finest "
        f"{LEAST_MESHES} meshes; the others carry the larger factors of their verdicts."
    )
    at = worst[first]
    bound = f"{100.0 * at.share(first):.2g} % of the load in {at.name}"
    if kept[first]:
        why = f"Mesh {meshes[first].label} is the coarsest that keeps {100.0 * target:g} %: largest bound {bound}."
    else:
        why = (
            f"No mesh keeps {100.0 * target:g} %. The finest, {meshes[first].label}, is taken; its largest bound is "
            f"{bound}. Refine further, or accept a larger target."
        )
    return meshes[first].label, kept[first], f"{why} {range_words}"
