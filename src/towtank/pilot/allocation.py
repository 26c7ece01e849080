"""From virtual rudder, elevator and aileron to fins that have limits."""

from __future__ import annotations

from dataclasses import dataclass

from towtank.craft.craft import Craft

Command = tuple[float, float, float]
"""Virtual rudder, elevator, aileron [rad]."""

Order = tuple[tuple[int, ...], ...]
"""Columns of the command (0 rudder, 1 elevator, 2 aileron) in groups, the first served first."""

YAW_AND_PITCH_FIRST: Order = ((0, 1), (2,))
RUDDER_FIRST: Order = ((0,), (1,), (2,))
ELEVATOR_FIRST: Order = ((1,), (0,), (2,))


@dataclass(frozen=True)
class Allocation:
    """Mixing and limits of the fins.

    rows (n, 3) : angle of each fin from rudder, elevator, aileron.   limits (n,) : largest angle of each fin [rad].
    """

    rows: tuple[tuple[float, ...], ...]
    limits: tuple[float, ...]

    def __call__(self, command: Command, order: Order = YAW_AND_PITCH_FIRST) -> Command:
        """The part of ``command`` [rad] that keeps every fin within its limit.

        Groups of columns are served in ``order``; a group that asks for more than is left is scaled down as a whole,
        so that its direction is kept. With the default order roll gets what yaw and pitch leave over.

        Source     Allocator of the LAUV: yaw and pitch first, roll from the rest (THEORY section 5).
        """
        if all(abs(angle) <= limit for angle, limit in zip(self.fins(command), self.limits, strict=True)):
            return command
        granted = [0.0, 0.0, 0.0]
        used = [0.0] * len(self.limits)
        for group in order:
            asked = [sum(row[i] * command[i] for i in group) for row in self.rows]
            share = 1.0
            for want, have, limit in zip(asked, used, self.limits, strict=True):
                total = have + share * want
                if want != 0.0 and abs(total) > limit:
                    room = max(limit - have, 0.0) if total > 0.0 else max(limit + have, 0.0)
                    share = min(share, room / abs(want))
            for i in group:
                granted[i] = share * command[i]
            used = [have + share * want for have, want in zip(used, asked, strict=True)]
        return granted[0], granted[1], granted[2]

    def fins(self, command: Command) -> list[float]:
        """Fin angles (n,) [rad] of ``command``."""
        dr, de, da = command
        return [a * dr + b * de + c * da for a, b, c in self.rows]


def allocation(craft: Craft) -> Allocation:
    """Allocation of a craft's fins."""
    rows = tuple((float(a), float(b), float(c)) for a, b, c in craft.mixing)
    return Allocation(rows, tuple(float(fin.max_angle) for fin in craft.fins))
