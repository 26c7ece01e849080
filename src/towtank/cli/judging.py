"""The verdict of a study: what it is judged by, and its table for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towtank.cli.scatter import compiled, scatter
from towtank.cli.study import file_hash

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.verdict.table import Requirement, Verdict

STANDARD = "standard"
"""Word that stands for the set of the package."""
MANY = 99
"""Standard uncertainties beyond which their number says nothing more."""


def inputs(chain: Chain) -> dict[str, str]:
    """What the verdict depends on beside craft, derivatives and trials: the drawn craft and the requirements."""
    from towtank.montecarlo.craft import FILE

    drawn = file_hash(chain.study.root / FILE) if chain.done("mc") else ""
    source = asked(chain)
    return {"drawn": drawn, "requirements": file_hash(source) if source else ""}


def asked(chain: Chain) -> Path | None:
    """The file of requirements: given now, or kept in the study; None for the standard set."""
    if chain.requirements is not None:
        return None if chain.requirements == STANDARD else Path(chain.requirements)
    kept = chain.study.requirements
    return kept if kept.exists() else None


def _keep(chain: Chain) -> None:
    """Put the requirements that were given now, and could be judged, into the study."""
    from towtank.artefact import write_text

    own, source = chain.study.requirements, asked(chain)
    if source is None:
        own.unlink(missing_ok=True)
    elif not own.exists() or not own.samefile(source):
        write_text(own, source.read_text(encoding="utf-8"))


def prepare(chain: Chain) -> None:
    """The trials that requirements are put to, flown by the best estimate and by drawn craft.

    Raises
    ------
    InputError
        The file of requirements cannot be used.
    """
    from towtank.verdict.needs import read_requirements

    if source := asked(chain):
        read_requirements(source)
    chain.try_out()
    if chain.done("mc") or compiled(chain):
        scatter(chain)
    else:
        chain.reply.log("mc       left out: no compiled engine. Requirements on trials get no probability; see doctor.")


def judge(chain: Chain) -> Sequence[Path]:
    """Write the verdict. The requirements of the study change only when those given now could be judged."""
    from towtank.montecarlo.craft import read_population
    from towtank.verdict.assess import assess
    from towtank.verdict.files import write_verdict
    from towtank.verdict.needs import read_requirements

    study, model, source = chain.study, chain.model(), asked(chain)
    needs = read_requirements(source) if source else None
    population = read_population(study.root, model) if chain.done("mc") else None
    found = assess(model, chain.trajectories(), needs, population)
    _keep(chain)
    write_verdict(found, chain.replacing(study.verdict))
    return (study.verdict,)


def tell(chain: Chain) -> None:
    """Words and requirements of the verdict, for people and for the JSON document."""
    from towtank.verdict.files import read_verdict

    found = read_verdict(chain.study.verdict)
    chain.reply.summary |= chain.verdict() | {"requirements": [_entry(r) for r in found.requirements]}
    chain.reply.tell(found.words)
    chain.reply.say("")
    for line in lines(found):
        chain.reply.say(line)


def lines(found: Verdict) -> list[str]:
    """The requirements as a table, and under it what was drawn."""
    asked = [r for r in found.requirements if r.sense]
    wide = max((len(r.name) for r in asked), default=0)
    head = f"{'':<{wide + 9}} {'best':>9} {'':<8} {'limit':>9} {'':<6} {'margin':>9} {'/std':>6} {'P':>7}  driven by"
    out = [head] if asked else []
    for r in asked:
        out.append(
            f"{'met' if r.met else 'NOT MET':<8} {r.name:<{wide}} {_number(r.value):>9} {r.sense:<8} "
            f"{_number(r.limit):>9} {r.unit:<6} {_number(r.margin):>9} {_in_std(r):>6} "
            f"{_percent(r.probability):>7}  {_driver(r)}".rstrip()
        )
    if asked:
        out += ["", f"P: share of {found.drawn} that meets it. Driven by: change of the number for 1 % more of it."]
    if any(math.isnan(r.probability) and not r.on_share for r in asked):
        out.append("No P (-): no drawn craft has made the trial. `towtank mc` flies the standard ones.")
    if math.isfinite(found.together):
        out.append(f"All that are put to single craft, together: {_percent(found.together)}.")
    return out


def _entry(r: Requirement) -> dict[str, Any]:
    drivers = [{"coefficient": d.coefficient, "per_percent": d.per_percent, "effect": d.effect} for d in r.drivers]
    return {
        "name": r.name, "met": r.met, "value": r.value, "unit": r.unit, "sense": r.sense, "limit": r.limit,
        "margin": r.margin, "margin_in_std": r.margin_in_std, "probability": r.probability, "drivers": drivers,
    }  # fmt: skip


def _driver(r: Requirement) -> str:
    return f"{r.drivers[0].coefficient} {r.drivers[0].per_percent:+.2g} {r.unit}".rstrip() if r.drivers else ""


def _number(value: float, digits: int = 4) -> str:
    return "none" if math.isinf(value) else f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _in_std(r: Requirement) -> str:
    if abs(r.margin_in_std) > MANY:
        return f">{MANY}" if r.margin > 0.0 else f"<-{MANY}"
    return f"{r.margin_in_std:.1f}" if math.isfinite(r.margin_in_std) else "-"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else "-"
