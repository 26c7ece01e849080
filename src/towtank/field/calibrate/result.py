"""What a calibration gives: the corrected set, how far each value moved, what the records could not tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from towtank.derive.table import Derivatives
from towtank.experiments.update import SURPRISE
from towtank.field.calibrate.score import Score

SQUARES = (0.5, 2.0)
"""Mean square of what is left of a channel, in its stated variance, outside which the stated noise does not fit.
Judgement: a standard deviation that is off by 40 % either way."""


@dataclass(frozen=True)
class Move:
    """A value before and after. sigmas : its move in standard deviations of the prior.   left : std after over before.

    told : the records speak of it.   slope : it is a slope at the origin, which moves only with the terms.
    """

    name: str
    unit: str
    prior: float
    prior_std: float
    value: float
    std: float
    told: bool
    slope: bool = False

    @property
    def sigmas(self) -> float:
        """Move in prior standard deviations; 0 for a value that was exact."""
        return (self.value - self.prior) / self.prior_std if self.prior_std > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Standard deviation after over that before; 1 for a value that was exact."""
        return self.std / self.prior_std if self.prior_std > 0.0 else 1.0


@dataclass(frozen=True)
class Direction:
    """A combination of coefficients that is known apart from the others. left : its std after over before.

    parts : term -> its weight, in prior standard deviations; the largest, of a vector of length 1.
    """

    left: float
    parts: Mapping[str, float]


@dataclass(frozen=True)
class RecordTable:
    """What was found of a record.

    shared : thrust, current, biases -> (value, std).   noise : std of the turbulence, level and down [m/s], spectral
    densities push and twist.   channels : name -> samples, std, chi2 (1 expected), taken (by the unknowns).
    """

    name: str
    level: str
    hash: str
    seconds: float
    windows: int
    left_out: int
    assumed: tuple[str, ...]
    shared: Mapping[str, tuple[float, float]]
    noise: Mapping[str, float]
    channels: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class HoldOut:
    """A record that took no part, foretold by both sets."""

    before: Score
    after: Score

    @property
    def ratio(self) -> float:
        """What is missed after over what was missed before."""
        return self.after.total / self.before.total


@dataclass(frozen=True)
class Calibration:
    """A set of derivatives corrected by records.

    derivatives : the new set.   prior : the one before.   moves : of each term and slope that may move.
    directions : combinations by what is left of them, least first.   records, hold_out : tables.
    cost : sums of squares before and after; terms : measurements.   rounds, settled : of the search.
    """

    derivatives: Derivatives
    prior: Derivatives
    moves: tuple[Move, ...]
    directions: tuple[Direction, ...]
    records: tuple[RecordTable, ...]
    cost: tuple[float, ...]
    settled: bool
    warnings: tuple[str, ...]
    hold_out: tuple[HoldOut, ...] = ()

    @property
    def told(self) -> tuple[str, ...]:
        """Terms of which the records speak."""
        return tuple(move.name for move in self.moves if move.told and not move.slope)

    @property
    def untold(self) -> tuple[str, ...]:
        """Terms that the records cannot tell: they rest on the prior."""
        return tuple(move.name for move in self.moves if not move.told and not move.slope)

    def words(self) -> list[str]:
        """What cannot be told, in sentences."""
        out = []
        if self.untold:
            out.append(
                f"Not told by the records: {', '.join(self.untold)}. Their standard deviation falls by less than a "
                "tenth, so they rest on the prior, moved only with what they are correlated to. A manoeuvre that "
                "excites them is needed to know them."
            )
        weak = [d for d in self.directions if d.left > WEAK]
        if weak:
            out.append(
                f"{len(weak)} of {len(self.directions)} independent combinations of coefficients stay as the prior has "
                f"them (more than {100 * WEAK:.0f} % of the standard deviation is left)."
            )
        return out


WEAK = 0.9
"""Share of a standard deviation above which a combination counts as not told."""


def warnings(
    moves: tuple[Move, ...], records: tuple[RecordTable, ...], fixed: tuple[str, ...], settled: bool
) -> list[str]:
    """Sentences on what does not fit."""
    out = []
    if not settled:
        out.append(
            "The search did not end by itself: its values are not the most likely ones. Let it take more rounds, or "
            "leave out the record whose channels fit worst."
        )
    for move in moves:
        if abs(move.sigmas) > SURPRISE and not move.slope:
            out.append(
                f"{move.name} moved by {move.sigmas:+.1f} prior standard deviations: the prior was surer than it was "
                "right, or the record holds something that the model does not. Check the channels of the record first."
            )
    for record in records:
        for name, row in record.channels.items():
            if not SQUARES[0] <= row["chi2"] <= SQUARES[1]:
                out.append(
                    f"{record.name}: what is left of {name} has {row['chi2']:.2g} times the variance stated "
                    f"(std {row['std']:.3g}{', assumed' if name in record.assumed else ''}). The intervals assume the "
                    "stated noise: correct it in the mapping of the record, or look for an error of the sensor."
                )
    if fixed:
        out.append(
            f"{', '.join(fixed)}: the prior states no uncertainty, so no record can move it. Give it one, or leave it "
            "out."
        )
    return out


def document(it: Calibration) -> dict[str, Any]:
    """Tables as plain JSON content."""
    moves = [{**asdict(move), "sigmas": move.sigmas, "left": move.left} for move in it.moves]
    held = [{"before": asdict(h.before), "after": asdict(h.after), "ratio": h.ratio} for h in it.hold_out]
    return {
        "level": it.derivatives.level,
        "prior": {"level": it.prior.level, "inputs": len(it.prior.provenance.get("inputs", {}))},
        "moves": moves, "told": list(it.told), "not_told": list(it.untold), "words": it.words(),
        "directions": [{"left": d.left, "parts": dict(d.parts)} for d in it.directions],
        "records": [asdict(record) for record in it.records], "hold_out": held, "cost": list(it.cost),
        "rounds": len(it.cost) - 1, "settled": it.settled, "warnings": list(it.warnings),
    }  # fmt: skip
