"""``towtank run --budget``: the tests worth the time, run in OpenFOAM, correct the fast tank's derivatives."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli import budget, towing
from towtank.cli.app import app
from towtank.cli.chain import open_chain
from towtank.cli.reply import Reply

runner = CliRunner()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--budget", "1 h"), "--budget chooses the tests of --tank openfoam"),
        (("--tank", "openfoam", "--budget", "0 s"), "runs need time"),
        (("--tank", "openfoam", "--budget", "1 m"), "--budget"),
        (("--tank", "openfoam", "--budget", "1 h", "--only", "drift"), "and no --only"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path: Path, words: tuple[str, ...], told: str):
    result = runner.invoke(app, ["run", "suboff-bare", *words, "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert told in " ".join(result.stderr.split())


def test_a_budget_for_no_test_says_what_the_cheapest_takes(tmp_path: Path):
    result = runner.invoke(
        app, ["run", "suboff-bare", "--tank", "openfoam", "--budget", "0.1 s", "--out", str(tmp_path)]
    )
    assert result.exit_code == 2
    assert "the cheapest test takes about" in " ".join(result.stderr.split())


def test_tests_within_the_budget_are_run_and_correct_the_fast_tank(tmp_path: Path):
    """Two cores' worth of a coarse mesh: some ten CPU seconds."""
    chain = open_chain(Reply("run"), "suboff-bare", tmp_path / "study")
    towing.ask(chain, "openfoam", refinement=0.6, jobs=1, budget=budget.seconds("12 s"))
    chain.prepare()
    chain.make_plan()
    budget.choose_tests(chain)
    names = towing.asked(chain)["only"].split(",")
    assert 1 <= len(names) < 10
    chain.tow()
    chain.derive()
    found = json.loads((tmp_path / "study" / "derivatives.json").read_text())
    assert found["level"] == "rans + semi-empirical"
    told = found["quality"]["fidelity"]
    assert sorted(entry["run"] for entry in told["bought"]) == sorted(names)
    prior = budget.prior(chain)
    assert any(abs(entry["value"] - prior[name]) > 1e-6 * abs(prior[name]) for name, entry in found["terms"].items())
    # what the study was asked is kept: a command without words goes on with the same tests
    again = open_chain(Reply("derive"), None, tmp_path / "study")
    assert towing.asked(again)["budget"] == "12"
    assert again.done("derive")
