"""A comparison in words and as rows of a table."""

from __future__ import annotations

import math

from towtank.field.comparing.result import ChannelScore, Comparison, Score

_FACTORS = {"rad": (180.0 / math.pi, "deg"), "rad/s": (180.0 / math.pi, "deg/s"), "rad/m": (180.0 / math.pi, "deg/m")}

CHANNEL_HEAD = (
    "channel", "unit", "samples", "bias", "U_val", "validated", "rms", "rms expected", "rms / std", "inside",
    "with noise",
)  # fmt: skip
METRIC_HEAD = ("metric", "unit", "record", "model", "E", "U_val", "input", "numerical", "data", "validated")


def shown(value: float, unit: str) -> float:
    """``value`` in the unit that people read: degrees for radians."""
    return value * _FACTORS.get(unit, (1.0, ""))[0]


def unit_of(unit: str) -> str:
    """The unit that people read."""
    return _FACTORS.get(unit, (1.0, unit))[1]


def short(value: float, digits: int = 3) -> str:
    """``value`` with some digits; "-" when there is none."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def level_of(score: Score) -> str:
    """Yes for |E| within U_val, no for beyond, a dash where it is not told."""
    return {None: "-", True: "yes", False: "no"}[score.validated]


def channel_row(one: ChannelScore) -> tuple[str, ...]:
    """Cells under ``CHANNEL_HEAD``."""
    values = (one.bias.record, one.bias.uncertainty.total, one.rms, one.expected)
    bias, level, rms, expected = (short(shown(value, one.unit)) for value in values)
    return (
        one.channel, unit_of(one.unit), str(one.samples), bias, level, level_of(one.bias), rms, expected,
        short(one.nrms, 2), _percent(one.inside), _percent(one.inside_with_noise) if one.noise > 0.0 else "-",
    )  # fmt: skip


def metric_row(one: Score) -> tuple[str, ...]:
    """Cells under ``METRIC_HEAD``."""
    u = one.uncertainty
    values = (one.record, one.model, one.error, u.total, u.input, u.numerical, u.data)
    return (one.name, unit_of(one.unit), *(short(shown(value, one.unit)) for value in values), level_of(one))


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else "-"


def what(it: Comparison) -> str:
    """What was laid beside what, in a sentence or two."""
    how = (
        "its fin angles in open loop" if it.loop == "open" else f"its orders through the pilot {it.pilot or 'designed'}"
    )
    again = f", begun again every {it.horizon:g} s from the record" if it.horizon else ""
    kind = "A SYNTHETIC record, made up by a program" if it.record_level == "synthetic" else "A record of the sea"
    return (
        f"{kind}, {it.name}: the model of {it.craft} ({it.level}) is flown with {how}{again}, over {it.flown:.4g} s in "
        f"{len(it.parts)} {'part' if len(it.parts) == 1 else 'parts'}, beside {it.samples} drawn craft."
    )


def verdict(it: Comparison) -> str:
    """How many numbers are validated at which level, and what that means.

    Source     ittc75030101; asmevv20.
    """
    done, known = it.validated
    beyond = [one.name for one in it.scores if one.validated is False]
    text = (
        f"{done} of {known} numbers have |E| <= U_val, E being record less model: for these the model is validated at "
        "the level U_val, and no smaller error of it can be told from this record."
    )
    if wide := vague(it):
        text += (
            f" Of {', '.join(wide)} U_val is as large as what the record does: the level says nothing. A shorter "
            "horizon or derivatives better known narrow it."
        )
    if beyond:
        text += (
            f" For {', '.join(beyond)} |E| > U_val: there E is the error of the model, in sign and size, but for what "
            "U_val leaves out."
        )
    return text


def vague(it: Comparison) -> list[str]:
    """Numbers that are validated at a level as large as the record's own spread, or its own value."""
    channels = [
        one.bias.name for one in it.channels
        if one.bias.validated and one.nrms > 0.0 and one.bias.uncertainty.total > one.rms / one.nrms
    ]  # fmt: skip
    return channels + [one.name for one in it.metrics if one.validated and one.uncertainty.total > abs(one.record)]


def limits(it: Comparison) -> str:
    """Which uncertainties are in U_val and which are not."""
    return f"In U_val: {'; '.join(it.included)}. Not in it: {'; '.join(it.missing)}."
