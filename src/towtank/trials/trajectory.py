"""Trajectory: what happened in a free-running trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.frames import Array


@dataclass(frozen=True)
class Trajectory:
    """N samples of a free-running trial, NED world, SI.

    name : file name in ``trials/``; kind : "turning circle", "zigzag", ...; loop : "open" or "closed".
    time (N,); position (N, 3) north, east, down [m]; attitude (N, 3) phi, theta, psi [rad, psi unwrapped];
    nu (N, 6) body velocities over ground; delta (N, n_fins) fin angles [rad];
    command (N, 3) virtual rudder, elevator, aileron asked for [rad]; setpoint : name -> (N,) (heading, depth, ...).
    indices : name -> (value, unit), such as advance, transfer, first overshoot.
    status : "done", or why the trial ended early.
    """

    name: str
    kind: str
    loop: str
    craft: str
    level: str
    time: Array
    position: Array
    attitude: Array
    nu: Array
    delta: Array
    command: Array
    setpoint: Mapping[str, Array] = field(default_factory=dict)
    indices: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    status: str = "done"
    provenance: Mapping[str, Any] = field(default_factory=dict)
