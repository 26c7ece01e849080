"""Stability: eigenvalues and stability indices against speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAD, FIT, GREY, OK, ORIGIN, frame, head, legend, new_axes
from towtank.frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class PoleSweep:
    """Eigenvalues of one plane over speed.

    plane : "horizontal" or "vertical".   level : of the derivatives behind.   speed (n,) [m/s];
    eigenvalues (n, k) complex [1/s].   indices : words -> stability index, such as "G_h, slope at the origin".
    band (2, n) : 5 and 95 % of the largest real part over drawn craft [1/s], or None.
    """

    plane: str
    level: str
    speed: Array
    eigenvalues: np.ndarray[tuple[int, int], np.dtype[np.complex128]]
    indices: Mapping[str, float] = field(default_factory=dict)
    band: Array | None = None


def pole_map(sweep: PoleSweep, ax: Axes | None = None) -> Axes:
    """Eigenvalues [1/s] in the complex plane, darker with speed; the unstable half plane is tinted."""
    ax = new_axes(ax, width=4.2, height=3.4)
    real, imag = sweep.eigenvalues.real, sweep.eigenvalues.imag
    shade = np.repeat(np.asarray(sweep.speed)[:, None], real.shape[1], axis=1)
    ax.axvspan(0.0, 1e6, color="#f6dfd8", alpha=0.6, linewidth=0)
    points = ax.scatter(real.ravel(), imag.ravel(), c=shade.ravel(), cmap="viridis_r", s=12, linewidths=0, zorder=3)
    width = max(float(np.ptp(real)), 1e-3)
    ax.set_xlim(float(real.min()) - 0.08 * width, max(float(real.max()) + 0.12 * width, 0.12 * width))
    height = max(float(np.abs(imag).max()), 0.05 * width)
    ax.set_ylim(-1.25 * height, 1.25 * height)
    frame(ax, "real part [1/s]", "imaginary part [1/s]")
    bar = ax.figure.colorbar(points, ax=ax, pad=0.02, aspect=30)
    bar.set_label("speed [m/s]", fontsize="x-small")
    bar.ax.tick_params(labelsize="x-small")
    text = "\n".join(f"{name} = {value:+.3f}" for name, value in sweep.indices.items())
    ax.annotate(text, (0.02, 0.03), xycoords="axes fraction", fontsize=6.5, va="bottom", parse_math=False)
    head(ax, f"Poles against speed, {sweep.plane} plane", sweep.level, "nominal coefficients, no band")
    return ax


def real_parts(sweeps: Sequence[PoleSweep], ax: Axes | None = None) -> Axes:
    """Largest real part of the eigenvalues [1/s] of each plane against speed [m/s]; above zero is unstable."""
    ax = new_axes(ax, width=4.2, height=2.8)
    for colour, sweep in zip((FIT, ORIGIN), sweeps, strict=False):
        if sweep.band is not None:
            ax.fill_between(sweep.speed, *sweep.band, color=colour, alpha=0.18, linewidth=0)
        ax.plot(
            sweep.speed,
            sweep.eigenvalues.real.max(axis=1),
            "o-",
            color=colour,
            markersize=3,
            linewidth=1.2,
            label=sweep.plane,
        )
    frame(ax, "speed [m/s]", "largest real part [1/s]")
    low, high = ax.get_ylim()
    ax.axhspan(0.0, max(high, 1e-6), color="#f6dfd8", alpha=0.5, linewidth=0)
    ax.set_ylim(low, max(high, 0.1 * abs(low)))
    level = sweeps[0].level if sweeps else ""
    banded = any(sweep.band is not None for sweep in sweeps)
    words = "lines: best estimate; bands: 5 to 95 % of drawn craft" if banded else "nominal coefficients, no band"
    head(ax, "Slowest mode against speed", level, words)
    legend(ax)
    return ax


def stability_index(name: str, samples: Array, nominal: float, level: str, ax: Axes | None = None) -> Axes:
    """Histogram of a stability index over the sampled coefficients.

    The share above zero is the probability of stability.
    """
    ax = new_axes(ax, width=4.2, height=2.8)
    samples = np.asarray(samples)[np.isfinite(samples)]
    low, high = np.percentile(samples, (1.0, 99.0)) if len(samples) else (-1.0, 1.0)
    edges = np.linspace(min(low, 0.0, nominal), max(high, 0.0, nominal) + 1e-9, 41)
    counts, _ = np.histogram(samples, edges)
    ax.bar(
        edges[:-1],
        counts / max(len(samples), 1),
        np.diff(edges),
        align="edge",
        color=[OK if e >= 0 else BAD for e in edges[:-1]],
        alpha=0.6,
    )
    ax.axvline(nominal, color=GREY, linewidth=1.2, linestyle="--", label=f"nominal {nominal:+.3f}")
    frame(ax, f"{name} [-], above 0 is stable", "share of samples")
    head(ax, f"{name} over the uncertainty", level, f"{len(samples)} samples of fit and model form; 1-99 % shown")
    legend(ax)
    return ax
