"""``derivatives.json``: written whole, read back equal."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.derive.fin_curve import fin_curve_document, fin_curve_of
from towtank.derive.table import Derivatives, Reference
from towtank.errors import ArtefactError
from towtank.symbols import TERMS

SCHEMA = "towtank/derivatives/1"


def write_derivatives(d: Derivatives, path: Path | str) -> Path:
    """Write ``d`` as JSON; values in SI, covariances in the order of ``order``.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(Path(path), document(d))


def document(d: Derivatives) -> dict[str, Any]:
    """The content of ``derivatives.json``."""
    from towtank.derive.show import prime_factor, std_parts

    parts = std_parts(d)
    total = np.sqrt(np.diag(d.covariance))
    terms = {
        name: {
            "value": float(d.values[i]),
            "std": float(total[i]),
            "unit": TERMS[name].unit,
            "prime": float(d.values[i]) / prime_factor(d, name),
            "std_parts": {part: float(std[i]) for part, std in parts.items()},
            "runs": list(d.runs.get(name, ())),
        }
        for i, name in enumerate(d.names)
    }
    return {
        "schema": SCHEMA,
        "craft": d.craft,
        "level": d.level,
        "variant": d.variant,
        "reference": asdict(d.reference),
        "terms": terms,
        "order": list(d.names),
        "covariance": d.covariance,
        "covariance_parts": {"fit": d.covariance_fit, "mesh": d.covariance_mesh, "model": d.covariance_model},
        "origin": {
            name: {"value": value, "std": d.origin_std.get(name, 0.0), "prime": value / prime_factor(d, name)}
            for name, value in d.origin.items()
        },
        "fin_curve": fin_curve_document(d.fin_curve),
        "rejected": [{"run": run, "why": why} for run, why in d.rejected],
        "quality": dict(d.quality),
        "provenance": dict(d.provenance),
    }


def read_derivatives(path: Path | str) -> Derivatives:
    """Read what ``write_derivatives`` wrote.

    Raises
    ------
    ArtefactError
        Missing, not JSON, another schema, or a part is missing or of the wrong size.
    """
    content = read_json(Path(path), SCHEMA)
    try:
        return _derivatives(content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ArtefactError(
            f"{path} is not a whole set of derivatives ({type(error).__name__}: {error}). "
            "Every term needs value, std and runs, and the covariances the size of order. Derive again."
        ) from None


def from_document(content: dict[str, Any]) -> Derivatives:
    """Derivatives of the content that ``document`` gives. KeyError, TypeError or ValueError when it is not whole."""
    return _derivatives(content)


def _derivatives(content: dict[str, Any]) -> Derivatives:
    names = tuple(content["order"])
    unknown = [name for name in names if name not in TERMS]
    if unknown:
        raise ValueError(f"unknown terms {', '.join(unknown)}")
    terms, size = content["terms"], len(names)
    parts = {k: np.array(content["covariance_parts"][k], dtype=float) for k in ("fit", "mesh", "model")}
    for part, matrix in parts.items():
        if matrix.size != size * size or not np.isfinite(matrix).all():
            raise ValueError(f"covariance {part} is not {size} x {size} finite numbers")
    values = np.array([terms[name]["value"] for name in names], dtype=float)
    if not np.isfinite(values).all():
        raise ValueError("a value is not finite")
    return Derivatives(
        craft=content["craft"],
        level=content["level"],
        variant=content["variant"],
        reference=Reference(**content["reference"]),
        names=names,
        values=values,
        covariance_fit=parts["fit"].reshape(size, size),
        covariance_mesh=parts["mesh"].reshape(size, size),
        covariance_model=parts["model"].reshape(size, size),
        runs={name: tuple(terms[name]["runs"]) for name in names},
        rejected=tuple((item["run"], item["why"]) for item in content["rejected"]),
        origin={name: float(item["value"]) for name, item in content["origin"].items()},
        origin_std={name: float(item["std"]) for name, item in content["origin"].items()},
        quality=content["quality"],
        provenance=content["provenance"],
        fin_curve=fin_curve_of(content.get("fin_curve")),
    )
