"""The set of derivatives after a calibration: values, covariance by parts, slopes at the origin, where it is from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from towtank.derive.consistency import consistency
from towtank.derive.covariance import NULL
from towtank.derive.table import Derivatives
from towtank.experiments.belief import believe
from towtank.field.calibrate.unknowns import Unknowns
from towtank.field.log import SeaLog
from towtank.frames import Array
from towtank.provenance import provenance


@dataclass(frozen=True)
class Posterior:
    """Independent terms and slopes after a fit. terms (k,), slopes (p,).

    parts : "fit", "mesh", "model" -> covariance (k, k) of the terms.   own (p, p), with_terms (p, k) : covariance of
    the slopes, and of slopes with terms.
    """

    terms: Array
    slopes: Array
    parts: Mapping[str, Array]
    own: Array
    with_terms: Array


def posterior(unknowns: Unknowns, z: Array, covariance: Array) -> Posterior:
    """What z (k,) with ``covariance`` (k, k) says of terms and slopes.

    Source     brysonho1975, ch. 12. The error left is L e + what the record adds: e is the prior's error, L = C M^-1, M
               and C the covariances before and after. Each part of the prior's covariance leaves L part L^T; "fit" gets
               C - L M L^T, what the record's own noise adds.
    """
    held = believe(unknowns.prior)
    c, k, root = len(unknowns.chosen), len(held.terms.values), unknowns.root
    M, C = root @ root.T, root @ covariance @ root.T
    own_terms = C[:c, :c] @ _inverse(M[:c, :c])
    left = np.eye(k)
    left[np.ix_(unknowns.chosen, unknowns.chosen)] = own_terms
    parts = {name: left @ part @ left.T for name, part in held.parts.items()}
    added = C[:c, :c] - own_terms @ M[:c, :c] @ own_terms.T
    parts["fit"][np.ix_(unknowns.chosen, unknowns.chosen)] += added
    values = unknowns.independent(z)
    total = held.root @ held.root.T
    slopes, own, across = held.slopes.values, total[k:, k:], total[k:, :k].copy()
    if c:
        slopes, own = slopes + root[c:] @ z, C[c:, c:]
        rows = [*unknowns.chosen.tolist(), *range(k, len(total))]
        gain = C @ _inverse(M)
        across = gain[c:] @ total[np.ix_(rows, range(k))]
        across[:, unknowns.chosen] = C[c:, :c]
    return Posterior(values, slopes, {name: 0.5 * (part + part.T) for name, part in parts.items()}, own, across)


def _inverse(matrix: Array) -> Array:
    """Inverse in the directions that ``matrix`` holds, in the scale of its own diagonal."""
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    back = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    return np.asarray(np.outer(back, back) * np.linalg.pinv(matrix * np.outer(back, back), rcond=NULL, hermitian=True))


def log_hash(log: SeaLog) -> str:
    """First 16 hex digits of the SHA-256 of the times and channels of a record."""
    out = hashlib.sha256(np.ascontiguousarray(log.time).tobytes())
    for name in sorted(log.channels):
        out.update(name.encode())
        out.update(np.ascontiguousarray(np.asarray(log.channels[name], dtype=float)).tobytes())
    return out.hexdigest()[:16]


def corrected(
    unknowns: Unknowns,
    z: Array,
    covariance: Array,
    logs: Sequence[SeaLog],
    told: Sequence[str],
    quality: dict[str, Any],
) -> Derivatives:
    """The prior's set, corrected. told : terms that the records speak of.   quality : what is said of the calibration.

    The level names the prior's and the records': "semi-empirical + sea record".
    """
    prior, found = unknowns.prior, posterior(unknowns, z, covariance)
    terms, slopes = unknowns.terms, unknowns.slopes
    parts = {name: terms.spread(part) for name, part in found.parts.items()}
    origin = dict(zip(slopes.names, slopes.expand(found.slopes).tolist(), strict=True))
    own = slopes.spread(found.own)
    std = dict(zip(origin, np.sqrt(np.maximum(np.diag(own), 0.0)).tolist(), strict=True))
    across = found.with_terms[np.ix_(slopes.index, terms.index)] * np.outer(slopes.sign, terms.sign)
    levels = {*prior.level.split(" + "), *(log.level for log in logs)}
    names = tuple(f"{log.level} {log.name}" for log in logs)
    values = terms.expand(found.terms)
    kept = dict(prior.quality)
    if slopes.names:
        kept["origin"] = {**prior.quality.get("origin", {}), "order": list(origin), "covariance": own.tolist(),
                          "with_terms": across.tolist()}  # fmt: skip
    out = replace(
        prior, level=" + ".join(sorted(levels)), values=values, covariance_fit=parts["fit"],
        covariance_mesh=parts["mesh"], covariance_model=parts["model"],
        runs={name: (*prior.runs.get(name, ()), *(names if name in told else ())) for name in prior.names},
        origin={**prior.origin, **origin}, origin_std={**prior.origin_std, **std},
        provenance=provenance({name: log_hash(log) for name, log in zip(names, logs, strict=True)},
                              prior=dict(prior.provenance)),
    )  # fmt: skip
    checks = [check.document() for check in consistency(replace(out, quality=kept))]
    return replace(out, quality={**kept, "consistency": checks, "calibration": quality})
