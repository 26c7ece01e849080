"""The page on the trust in runs says what the code does, and prints what it gives."""

import math
import re
from collections import Counter
from pathlib import Path

import pytest

from towtank.craft.library import read_craft
from towtank.derive.derive import derive
from towtank.derive.study import PAIR, STEPS, TOLERANCE, frequency_study
from towtank.derive.study_files import WORTH, study_table
from towtank.derive.verdicts import LIMITS
from towtank.plan.standard import standard_plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank

PAGE = (Path(__file__).parents[2] / "docs" / "study.md").read_text(encoding="utf-8")
PLAIN = re.sub(r"\s+", " ", PAGE)
ROWS = [
    [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
    for line in PAGE.splitlines()
    if line.startswith("|")
]


def test_every_test_is_printed_with_its_limits_and_its_reason():
    printed = {row[0]: row[1:] for row in ROWS if row[0] in LIMITS}
    assert list(printed) == list(LIMITS)
    for name, limit in LIMITS.items():
        size = 100.0 if limit.unit == "%" else 1.0
        bounds = [f"{size * bound:g} {limit.unit}" for bound in (limit.weigh, limit.reject)]
        assert printed[name] == [*bounds, limit.why], name


def test_every_verdict_has_its_row():
    assert {"accepted", "down-weighted", "rejected", "exploratory"} <= {row[0] for row in ROWS}


def test_numbers_of_the_text_are_those_of_the_code():
    assert f"by {100 * TOLERANCE:g} %, at most the limit" in PLAIN
    assert f"over a factor of {STEPS[-1] / STEPS[0]:g}" in PLAIN
    assert f"and {PAIR[0]:g} of it" in PLAIN
    assert f"at least {100 * WORTH:g} % of the load" in PLAIN


@pytest.fixture(scope="module")
def hokie():
    runs = tow(standard_plan(read_craft("hokie")), FastTank(members=0))
    found = derive(runs)
    return found, frequency_study(runs, found)


def test_printed_verdicts_of_hokie_are_those_it_gets(hokie):
    found = hokie[0].quality["screening"]
    counts = Counter(entry["verdict"] for entry in found.values())
    assert f"{counts['accepted']} accepted, {counts['down-weighted']} down-weighted" in PLAIN
    for name, entry in found.items():
        if entry["verdict"] == "down-weighted":
            assert f"{name}: down-weighted, trust {entry['trust']:.2g}. {entry['why']}" in PAGE


def test_printed_trends_and_advice_of_hokie_are_those_it_gets(hokie):
    # Five digits: what another processor changes is round-off.
    table = [line.strip() for line in study_table(hokie[1]).splitlines() if line.startswith("  ")]
    assert len(table) > 18
    for line in table:
        assert line in PAGE, line
    nvdot = next(t for t in hokie[1].trends if t.term == "Nvdot" and not math.isnan(t.growth))
    largest = max(p.amplitude for p in hokie[1].points if p.kind == "sway")
    assert abs(nvdot.growth * largest) > abs(nvdot.limit)
