"""A study within a budget: the fast tank says which tests are worth the time in OpenFOAM, and is corrected by them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from towtank.cli import towing
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.derive.table import Derivatives

DOUBT = 0.1
"""Share of each value by which the fast tank may be wrong beside its stated uncertainty; docs/fidelity.md gives the
coverage of the intervals that it was chosen on."""


def seconds(text: str) -> float:
    """Wall time [s] of ``--budget``.

    Raises
    ------
    InputError
        No time, or none above zero.
    """
    from towtank.quantity import si

    value = si(text, "s", "--budget")
    if value <= 0.0:
        raise InputError(f'--budget {text}: runs need time. Give one above zero, such as "1 h".')
    return value


def choose_tests(chain: Chain) -> None:
    """Ask for those tests of the plan only that are worth the budget, when there is one and none were chosen yet.

    Raises
    ------
    InputError
        The budget is too small for any test.
    """
    from towtank.experiments.fidelity import choose
    from towtank.tank.openfoam.errors import measured

    wanted = towing.asked(chain)
    if not wanted["budget"] or wanted["only"]:
        return
    tank = towing.openfoam(chain)
    tests = [test for test in chain.plan().tests if not test.exploratory and tank.able(test)]
    costs = tank.schedule(chain.craft, tests).costs
    price = dict(zip((test.name for test in tests), costs, strict=True))
    spare = float(wanted["budget"]) * towing.jobs(chain)
    errors = [error.size for error in measured(tank.measured_as)]
    alike = sum(errors) / len(errors) if errors else 0.0  # one model errs alike in all runs of a kind
    worth = choose(prior(chain), chain.craft, tests, lambda test: price[test.name], spare, doubt=DOUBT, alike=alike)
    if not worth:
        least = min(costs) / towing.jobs(chain)
        raise InputError(
            f"--budget {float(wanted['budget']):g} s: the cheapest test takes about {least:.0f} s here, and none that "
            "fits tells anything. Give more time, or a coarser --quality."
        )
    for choice in worth:
        chain.reply.log(f"  {choice.test.name:<24} {choice.cost:5.0f} s of CPU, expected to buy {choice.fall:.3g}")
    chain.reply.log(f"budget   {len(worth)} tests, {worth[-1].spent:.0f} of {spare:.0f} s of CPU")
    chain.towing = wanted | {"only": ",".join(choice.test.name for choice in worth)}


def corrected(chain: Chain) -> Derivatives:
    """The fast tank's derivatives, corrected by the runs of the study."""
    from towtank.cli.fitting import mesh_study
    from towtank.experiments.fidelity import correct

    return correct(prior(chain), chain.runs(), craft=chain.craft, grid=mesh_study(chain), doubt=DOUBT)


def prior(chain: Chain) -> Derivatives:
    """Derivatives of the whole plan in the fast tank."""
    from towtank.derive.derive import derive
    from towtank.tank.campaign import tow
    from towtank.tank.fast.tank import FastTank

    return derive(tow(chain.plan(), FastTank()))
