"""``tune.json``: what a tuning cost before and after, and on what it was done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import write_json
from towtank.pilot.files import UNITS
from towtank.provenance import provenance
from towtank.tuning.cases import ASKEW, QUICK, STEPS
from towtank.tuning.fence import ALPHA, GAIN
from towtank.tuning.margins import RobustMargins
from towtank.tuning.tune import Score, Tuned

SCHEMA = "towtank/tune/1"


def write_tuned(tuned: Tuned, path: str | Path, inputs: Mapping[str, str] | None = None) -> Path:
    """Write ``tuned`` as JSON, schema ``towtank/tune/1``; a margin without limit is null.

    inputs : name -> hash of what was read.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(Path(path), {"schema": SCHEMA, **summary(tuned), "provenance": provenance(inputs)})


def summary(tuned: Tuned) -> dict[str, Any]:
    """``tuned`` as plain content, SI and radians but for what ``Flown`` states in degrees."""
    gains = {
        name: {"before": getattr(tuned.start, name), "after": getattr(tuned.pilot, name), "unit": UNITS[name]}
        for name in (*tuned.moved, "pitch_order")
    }
    return {
        "craft": tuned.pilot.craft,
        "speeds": list(tuned.speeds),
        "steps": {name: asdict(STEPS[name]) for name in tuned.steps},
        "drawn": tuned.drawn,
        "seed": tuned.seed,
        "cost": {
            "terms": "mean squares over size: errors of heading, depth, roll; fin angles; fin speeds; fence; noise",
            "askew": float(ASKEW), "quick": QUICK, "fence_weight": tuned.weight,
            "fence": {"gain_factor": GAIN, "disk_margin": ALPHA, "phase": 2.0 * float(np.arctan(ALPHA / 2.0))},
        },
        "before": _score(tuned.before),
        "after": _score(tuned.after),
        "gains": gains,
        "rounds": tuned.rounds,
        "flights": tuned.flights,
        "wall_s": round(tuned.seconds, 3),
    }  # fmt: skip


def _score(score: Score) -> dict[str, Any]:
    return {
        "cost": score.cost, **asdict(score.price), "fence": score.fence, "noise": score.noise,
        "margins_kept": score.kept,
        "flights": [asdict(one) for one in score.flights],
        "margins": [None if m is None else _margins(m) for m in score.margins],
    }  # fmt: skip


def _margins(m: RobustMargins) -> dict[str, Any]:
    return {"gain_factor": m.gain, "phase": m.phase, **asdict(m)}
