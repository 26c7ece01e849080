"""Single-harmonic runs of known coefficients for the Fourier tests."""

from __future__ import annotations

import numpy as np

from towtank.plan.motion import Heave, Pitch, Roll, Surge, Sway, Yaw
from towtank.symbols import FOURFOLD_TIES, TERMS
from towtank.tank.run import Run
from towtank.terms import term_loads

L, U, RHO = 6.0, 1.0, 1000.0
W = 1.5 * U / L
AMPLITUDES = (0.05, 0.1)
"""Peak v/U, r L/U, u/U, or half of the roll angle [rad]."""


def truth() -> dict[str, float]:
    values = {}
    sway, yaw, rest = ("Xvv", "Yvdot", "Yuv", "Yvv", "Nvdot", "Nuv", "Nvv"), ("Xrr", "Yrdot", "Yur", "Yrr"), ("Xudot",)
    names = (*rest, "Xuu", *sway, *yaw, "Nrdot", "Nur", "Nrr", "Kpdot", "Kup", "Kpp")
    for i, name in enumerate(names):
        quadratic = 4.0 if name[1:] in ("vv", "rr", "pp") else 1.0
        values[name] = -TERMS[name].prime_factor(RHO, L, U) * 1e-3 * (3.0 + i % 5) * quadratic
    values["Nvdot"] = values["Yrdot"]
    return values | {name: sign * values[base] for name, (base, sign) in FOURFOLD_TIES.items() if base in values}


def oscillations(kind: str) -> list[Run]:
    runs = []
    for i, a in enumerate(AMPLITUDES):
        motion = {
            "sway": Sway(U, a * U / W, W), "heave": Heave(U, a * U / W, W), "surge": Surge(U, a * U / W, W),
            "yaw": Yaw(U, 0.2 * a * U / L * U / W**2, W), "pitch": Pitch(U, 0.2 * a * U / L * U / W**2, W),
            "roll": Roll(U, 2 * a, W),
        }[kind]  # fmt: skip
        time = np.arange(3 * 64 + 1) * motion.period / 64
        history = motion.history(time)
        control = np.zeros((len(time), 4))
        runs.append(
            Run(f"{kind}-{i}-x", f"{kind}-{i}", kind, "case", "fourfold", "known coefficients", U, motion.period, 3,
                RHO, L, 3.0, history, np.zeros((len(time), 4)), control,
                term_loads(truth(), history.nu, history.nudot, control))
        )  # fmt: skip
    return runs
