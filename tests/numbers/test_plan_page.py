"""The page on plans says what the code does."""

import math
from pathlib import Path

from towtank.craft.library import read_craft
from towtank.plan.limits import FREQUENCY_WARNING, FREQUENCY_WARNING_ELSE, LIMITS
from towtank.plan.motion import KINDS
from towtank.plan.standard import standard_plan

PAGE = (Path(__file__).parents[2] / "docs" / "plan.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("|")]


def test_every_kind_has_its_row():
    described = {word for row in ROWS for word in row[0].replace("`", "").split(", ")}
    assert set(KINDS) <= described


def test_every_limit_is_printed_with_its_two_numbers():
    warned = [row[1].split(" ")[0] for row in ROWS if len(row) == 4]
    refused = [row[2].split(" ")[0] for row in ROWS if len(row) == 4]
    for limit in LIMITS:
        degrees = limit.measure == "fin"
        refuse = math.degrees(limit.refuse) if degrees else limit.refuse
        assert f"{refuse:.3g}" in refused, limit.measure
        if limit.measure != "frequency":
            warn = math.degrees(limit.warn) if degrees else limit.warn
            assert f"{warn:.3g}" in warned, limit.measure
    assert {f"{value:g}" for value in (*FREQUENCY_WARNING.values(), FREQUENCY_WARNING_ELSE)} <= set(warned)


def test_the_number_of_runs_is_that_of_the_plan_and_of_its_parts():
    assert f"\n{len(standard_plan(read_craft('hokie')).tests)} runs." in PAGE
    parts = [int(row[2]) for row in ROWS if len(row) == 3 and row[2].isdigit()]
    assert sum(parts) == len(standard_plan(read_craft("hokie")).tests)
