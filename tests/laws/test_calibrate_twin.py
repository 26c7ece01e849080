"""The interval of a calibrated coefficient holds the truth as often as it says."""

from pathlib import Path

import numpy as np

from calibrate_cases import hokie, records
from tables import read_table
from towtank.field.calibrate.fit import case_of, fit
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.unknowns import unknowns
from towtank.field.calibrate.windows import windows_of
from towtank.field.sea_water import Environment
from towtank.progress import Silent

VALIDATION = Path(__file__).parents[2] / "validation"

SEAS = 4


def test_the_truth_of_a_few_seas_lies_within_the_intervals():
    model = hokie()
    free, settings = unknowns(model.derivatives), Settings()
    z = np.random.default_rng(8).standard_normal((SEAS, free.size))
    rows = [free.values(one) for one in z]
    parameters = {name: np.array([row[name] for row in rows]) for name in free.names}
    water = Environment(current=(0.05, -0.1, 0.0), turbulence=(0.02, 0.02, 0.005), piece=0.1, seed=9)
    inside = []
    for log, true in zip(records(model, 100.0, water, count=SEAS, seed=8, parameters=parameters), z, strict=True):
        found = fit([case_of(windows_of(model, log, settings), free.names, settings)], free, settings, Silent())
        assert found.settled
        root = free.root[: len(free.chosen)]
        std = np.sqrt(np.diag(root @ found.covariance @ root.T))
        inside.append(np.abs(root @ (found.z - true)) < 1.96 * std)
    # Coefficients of one sea err together: over the stored seas the share inside has a spread of 0.08 from sea to
    # sea. The mean of four lies above 0.95 - 3.5 * 0.08 / 2.
    assert np.mean(inside) > 0.81


def test_the_stored_twin_experiment_holds_the_truth_in_93_to_97_percent():
    table = {row["coefficient"]: row for row in read_table(VALIDATION / "calibrate_twin.csv")}
    assert int(table["all"]["seas"]) >= 200
    assert 0.93 <= float(table["all"]["coverage_95"]) <= 0.97
    # One coefficient over 200 seas: a share of 0.95 has a standard deviation of 0.015. The lowest is Kup, 0.88: it
    # is shifted by 0.6 of its standard deviation, as docs/calibrate.md says.
    assert min(float(row["coverage_95"]) for row in table.values()) > 0.87
