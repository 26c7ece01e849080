"""The page on the accuracy of the OpenFOAM tank prints the numbers of the tables of runs."""

from pathlib import Path

import pytest

from openfoam_suboff import SLOPES, TARGET
from tables import read_table

PAGE = (Path(__file__).parents[2] / "docs" / "openfoam-accuracy.md").read_text(encoding="utf-8")
ROWS = read_table(TARGET)
VARIANTS = {row["variant"] for row in ROWS if row["cells"]}
LINES = {
    cells[0]: cells
    for cells in ([cell.strip() for cell in line.split("|")[1:-1]] for line in PAGE.splitlines())
    if cells
}


def error(variant: str, test: str, load: str) -> str:
    (row,) = [r for r in ROWS if (r["variant"], r["test"], r["load"]) == (variant, test, load)]
    return row["error_percent"]


@pytest.mark.parametrize("variant", sorted(VARIANTS))
def test_every_variant_has_its_row_of_errors(variant):
    ran = {row["test"] for row in ROWS if row["variant"] == variant and row["cells"]}
    (cells,) = {row["cells"] for row in ROWS if row["variant"] == variant and row["cells"]}
    assert LINES[variant][2] == cells
    for column, angle in ((3, 4), (4, 12), (5, 18)):
        test = f"drift-{angle}"
        printed = ", ".join(error(variant, test, f"{load}'") for load in "XYN") if test in ran else "-"
        assert LINES[variant][column] == printed, (variant, angle)
    turn = ", ".join(error(variant, "turn", f"{load}'r") for load in "YN") if "turn" in ran else "-"
    assert LINES[variant][6] == turn


def test_the_slopes_with_fins_and_what_the_fins_add_are_printed():
    words, columns = {"fins": "with fins", "fins less bare": "added"}, ("Yv", "Nv", "Yr", "Nr")
    for row in read_table(SLOPES):
        if row["craft"] in words and row["quantity"] in columns:
            line = LINES[f"{words[row['craft']]}: {row['setup']}"]
            assert line[1 + columns.index(row["quantity"])] == row["error_percent"], row
