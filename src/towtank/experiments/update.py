"""The update of a belief by runs, and what is said about it: what each run bought, what moved, what is predicted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.cycles import Samples
from towtank.derive.table import Derivatives
from towtank.derive.verdicts import KEY_TERMS
from towtank.experiments.belief import Belief, Layout, Told
from towtank.experiments.evidence import SLOPES, gradient, stability_index
from towtank.frames import Array
from towtank.tank.run import Run
from towtank.terms import term_loads

SURPRISE = 3.0
"""Prior standard deviations by which a value may move before it is said that the prior was wrong there."""

RESTS = 0.01
"""Share of the information on a term for which a run is named, as in ``derive.quality``."""


@dataclass(frozen=True)
class Update:
    """A belief and what runs say of it: of the terms (``wide``), and of the slopes at the origin (``local``)."""

    belief: Belief
    layout: Layout
    runs: tuple[Run, ...]
    wide: tuple[Told, ...]
    local: tuple[Told, ...]

    @property
    def k(self) -> int:
        """Number of independent terms."""
        return len(self.belief.terms.values)

    @cached_property
    def inverse(self) -> Array:
        """Covariance (x, x) of the state after all runs, for the terms."""
        return posterior(self.wide, self.layout.size)

    @cached_property
    def inverse_local(self) -> Array:
        """The same for the slopes at the origin."""
        return posterior(self.local, self.layout.size)

    def terms(self) -> tuple[Array, dict[str, Array]]:
        """Corrected values (n,) of the terms, and the parts of their covariance (n, n)."""
        q, z = self.inverse, slice(0, self.layout.values)
        root = self.belief.root[: self.k]
        values = self.belief.terms.values + root @ (q @ np.sum([t.right for t in self.wide], axis=0))[z]
        left = np.eye(self.k) - root @ q[z] @ np.sum([t.terms for t in self.wide], axis=0)
        parts = {name: left @ part @ left.T for name, part in self.belief.parts.items()}
        parts["fit"] = parts["fit"] + root @ (q - q @ q)[z, z] @ root.T
        parts["mesh"] = parts["mesh"] + _outer(root @ q[z, self.layout.mesh])
        parts["model"] = parts["model"] + _outer(root @ q[z, self.layout.form])
        spread = self.belief.terms.spread
        return self.belief.terms.expand(values), {name: spread(0.5 * (p + p.T)) for name, p in parts.items()}

    def slopes(self) -> tuple[Array, Array]:
        """Corrected slopes at the origin (p,) and their covariance (p, p)."""
        q, root = self.inverse_local, self.belief.root[self.k :]
        z = slice(0, self.layout.values)
        values = self.belief.slopes.values + root @ (q @ np.sum([t.right for t in self.local], axis=0))[z]
        covariance = root @ q[z, z] @ root.T
        return self.belief.slopes.expand(values), self.belief.slopes.spread(0.5 * (covariance + covariance.T))


def posterior(runs: Iterable[Told], size: int) -> Array:
    """Covariance (x, x) of a state of unit variance after ``runs``."""
    return np.asarray(np.linalg.inv(sum((t.square for t in runs), np.eye(size))))


def _outer(a: Array) -> Array:
    return np.asarray(a @ a.T)


def rests(it: Update, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Term -> the prior's runs, and those of the new ones that hold ``RESTS`` of what the new ones say of it."""
    root = it.belief.root[: it.k]
    held = np.array([np.einsum("ij,jk,ik->i", root, t.square[: root.shape[1], : root.shape[1]], root) for t in it.wide])
    share = (held / np.maximum(held.sum(axis=0), 1e-300))[:, it.belief.terms.index]
    return {
        term: (
            *it.belief.prior.runs.get(term, ()),
            *(f"{run.level} {name}" for run, name, own in zip(it.runs, names, share[:, i], strict=True) if own > RESTS),
        )
        for i, term in enumerate(it.belief.terms.names)
    }


def origin_words(it: Update) -> str:
    """How the slopes at the origin were corrected."""
    if not it.belief.slopes.names:
        return "the prior states no slopes at the origin with their covariance: they are not corrected"
    near = sum(bool(np.any(a.square != b.square)) for a, b in zip(it.wide, it.local, strict=True))
    words = f"{near} steady runs of small angle, with a bend and a constant"
    if it.belief.joint:
        return f"{words}; the other runs through the terms, as far as the prior's ensemble moves both together"
    return f"{words}; the prior does not say how slopes and terms move together, so other runs do not correct them"


def bought(it: Update, names: Sequence[str], slopes: Mapping[str, float], craft: Craft | None) -> dict[str, Any]:
    """Standard deviations of the key derivatives and of the stability index before, and after each run in turn."""
    key = [name for name in KEY_TERMS if name in it.belief.terms.names]
    row = None if craft is None else index_row(it.belief, slopes, craft)
    steps: list[dict[str, Any]] = []
    for number in range(len(it.runs) + 1):
        q = posterior(it.wide[:number], it.layout.size)
        z = slice(0, it.layout.values)
        std = np.sqrt(np.einsum("ij,jk,ik->i", it.belief.root, q[z, z], it.belief.root))[: it.k][it.belief.terms.index]
        step: dict[str, Any] = {"std": {name: float(std[it.belief.terms.names.index(name)]) for name in key}}
        if row is not None:
            near = posterior(it.local[:number], it.layout.size)
            step["index"] = float(np.sqrt(row @ near[z, z] @ row))
        steps.append(step)
    out: dict[str, Any] = {"before": steps[0], "bought": []}
    for name, run, old, new in zip(names, it.runs, steps[:-1], steps[1:], strict=True):
        fall = {term: old["std"][term] - new["std"][term] for term in key}
        out["bought"].append({"run": name, "kind": run.kind, **new, "fall": fall})
    if row is not None and craft is not None:
        was = {name: it.belief.prior.origin[name] for name in SLOPES}
        out["index"] = {
            "prior": stability_index(was, craft), "corrected": stability_index(slopes, craft),
            "std_before": steps[0]["index"], "std": steps[-1]["index"],
        }  # fmt: skip
    return out


def index_row(belief: Belief, slopes: Mapping[str, float], craft: Craft) -> Array | None:
    """Change of the stability index per unit of z (k + p,), linear about ``slopes``; None where it has no value."""
    if not all(name in belief.slopes.names for name in SLOPES) or not np.isfinite(stability_index(slopes, craft)):
        return None
    out = np.zeros(len(belief.root))
    for name, part in gradient(slopes, craft).items():
        i = belief.slopes.names.index(name)
        row = belief.root[len(belief.terms.values) + int(belief.slopes.index[i])]
        out += part * float(belief.slopes.sign[i]) * row
    return out


def shifts(found: Derivatives, prior: Derivatives) -> dict[str, dict[str, float]]:
    """Term, or ``term at the origin`` -> prior, corrected, and the shift in standard deviations of the prior."""
    was = np.sqrt(np.maximum(np.diag(prior.covariance), 0.0))
    items = [(name, float(a), float(b), float(s)) for name, a, b, s in
             zip(prior.names, prior.values, found.values, was, strict=True)]  # fmt: skip
    items += [
        (f"{name} at the origin", value, found.origin[name], prior.origin_std.get(name, 0.0))
        for name, value in prior.origin.items()
    ]
    return {name: {"prior": a, "corrected": b, "sigmas": (b - a) / s if s > 0.0 else 0.0} for name, a, b, s in items}


def warnings(shift: Mapping[str, Mapping[str, float]]) -> list[str]:
    """A sentence for each value that moved by more than ``SURPRISE``."""
    return [
        f"{name} moved by {item['sigmas']:+.1f} prior standard deviations: the prior was surer than it was right. Its "
        "neighbours may be off too; run more of this kind, or correct with doubt=0.2."
        for name, item in shift.items()
        if abs(item["sigmas"]) > SURPRISE
    ]


def predictions(it: Update, names: Sequence[str], own: Sequence[Samples], values: Array) -> dict[str, dict[str, float]]:
    """Run -> root mean square of what each set misses, over that of the loads, each load counted in its scale."""
    sets = {"prior": it.belief.prior.as_dict(), "corrected": dict(zip(it.belief.prior.names, values, strict=True))}
    scale = np.where(it.belief.scale > 0.0, it.belief.scale, np.inf)
    out = {}
    for name, part in zip(names, own, strict=True):
        size = np.sqrt(((part.loads[0] / scale) ** 2).mean())
        missed = {
            word: part.loads[0] - term_loads(given, part.nu, part.nudot, part.control) for word, given in sets.items()
        }
        out[name] = {word: float(np.sqrt(((m / scale) ** 2).mean()) / max(size, 1e-300)) for word, m in missed.items()}
    return out
