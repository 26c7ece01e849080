"""The page on the campaign of hokie prints the numbers of its table."""

from pathlib import Path

from tables import read_table

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "openfoam-hokie.md").read_text(encoding="utf-8")
LINES = {
    cells[0]: cells for cells in ([c.strip() for c in line.split("|")[1:-1]] for line in PAGE.splitlines()) if cells
}
ROWS = read_table(ROOT / "validation" / "openfoam_hokie.csv")


def test_the_terms_on_the_page_are_those_of_the_table():
    terms = {row["name"]: row for row in ROWS if row["what"] == "term"}
    printed = [name for name in LINES if name in terms]
    assert len(printed) >= 13
    for name in printed:
        columns = ("openfoam", "deviation", "of_mesh", "fast_tank", "deviation_fast")
        assert LINES[name][1:] == [terms[name][column] for column in columns], name


def test_the_cost_on_the_page_is_that_of_the_table():
    costs = {row["name"]: row for row in ROWS if row["what"] == "cost"}
    for name, words in (("turn", "turn, with and without drift"), ("all", "all")):
        assert LINES[words][1:] == [costs[name]["openfoam"], costs[name]["fast_tank"]]
    kinds = [row for name, row in costs.items() if name not in ("all", "CPU seconds a derivative")]
    assert sum(int(row["openfoam"]) for row in kinds) == int(costs["all"]["openfoam"]) == 113
