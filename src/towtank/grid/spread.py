"""What a grid study says of the loads of other runs: the way from ``GridStudy`` to the weights of a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.grid.study import GridStudy
from towtank.symbols import LOADS
from towtank.tank.run import Run


def mesh_uncertainty(study: GridStudy, runs: Sequence[Run]) -> Array:
    """Standard discretisation uncertainty (R, 6) of the loads X Y Z K M N of each run [N, N m].

    ``GridStudy.share`` of the kind, load and mesh of the run, times the root mean square of the load over what is
    analysed. A run that does not name its mesh is taken to be on the chosen one. A load that the study does not hold in
    runs of that kind takes its largest share in the other kinds. One that it does not hold at all, such as the roll
    moment in a study without roll runs, takes the largest share of any load.

    Raises
    ------
    InputError
        A run of another craft or level than the study, or on a mesh that the study does not hold.
    """
    shares: dict[tuple[str, str], Array] = {}
    out = np.zeros((len(runs), len(LOADS)))
    for number, run in enumerate(runs):
        label = _label(study, run)
        if (run.kind, label) not in shares:
            shares[run.kind, label] = np.array([_share(study, run.kind, load, label) for load in LOADS])
        out[number] = shares[run.kind, label] * np.sqrt((run.loads[run.settled] ** 2).mean(axis=0))
    return out


def _share(study: GridStudy, kind: str, load: str, label: str) -> float:
    found = study.share(kind, load, label)
    if found is not None:
        return found
    kinds = dict.fromkeys(item.kind for item in study.quantities)
    held = [share for other in kinds if (share := study.share(other, load, label)) is not None]
    known = (study.share(item.kind, item.load, label) for item in study.quantities)
    return max(held or [share for share in known if share is not None])


def _label(study: GridStudy, run: Run) -> str:
    """The mesh of ``run``, if the study may speak for the run."""
    for what, own, theirs in (("craft", run.craft, study.craft), ("level", run.level, study.level)):
        if own != theirs:
            raise InputError(
                f"grid: run {run.name} has {what} {own!r}, the grid study {theirs!r}. The error of one mesh says "
                "nothing of another solver or shape; make a grid study of these runs, or leave the study out."
            )
    told = run.provenance.get("mesh")
    label = str(told["label"]) if isinstance(told, dict) and told.get("label") else study.chosen
    if label not in [mesh.label for mesh in study.meshes]:
        raise InputError(
            f"grid: run {run.name} was made on mesh {label!r}; the study holds "
            f"{', '.join(mesh.label for mesh in study.meshes)}. Add that mesh to the study, or run on one of these."
        )
    return label
