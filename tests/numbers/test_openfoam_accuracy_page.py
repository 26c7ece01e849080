"""The page on the accuracy of the OpenFOAM tank prints the numbers of the table of runs."""

from pathlib import Path

from openfoam_suboff import TARGET
from tables import read_table

PAGE = (Path(__file__).parents[2] / "docs" / "openfoam-accuracy.md").read_text(encoding="utf-8")
ROWS = read_table(TARGET)
NAMED = {row["variant"] for row in ROWS} - {"fins"}


def error(variant: str, test: str, load: str) -> str:
    (row,) = [r for r in ROWS if (r["variant"], r["test"], r["load"]) == (variant, test, load)]
    return row["error_percent"]


def test_every_variant_has_its_row_of_errors():
    lines = {line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[1:-1]] for line in PAGE.splitlines()
             if line.startswith("| ")}  # fmt: skip
    for variant in NAMED:
        cells = next(row["cells"] for row in ROWS if row["variant"] == variant and row["cells"])
        assert lines[variant][2] == cells
        for column, angle in ((3, 4), (4, 12), (5, 18)):
            printed = ", ".join(error(variant, f"drift-{angle}", f"{load}'") for load in "XYN")
            assert lines[variant][column] == printed, (variant, angle)


def test_the_slopes_of_the_arm_are_printed():
    for variant in ("draft", "sst", "standard"):
        for load in "YN":
            assert error(variant, "turn", f"{load}'r") in PAGE
    for test, load in (("drift-2", "Y'"), ("drift-2", "N'"), ("turn", "Y'r"), ("turn", "N'r")):
        assert error("fins", test, load) in PAGE
