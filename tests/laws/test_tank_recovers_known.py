"""The standard plan through the tank of known coefficients, seen by plain least squares: nothing of the fit is ours."""

import numpy as np

from towtank.craft.library import read_craft
from towtank.plan.standard import standard_plan
from towtank.symbols import FOURFOLD_ADDED_MASS, FOURFOLD_TIES, STANDING, TERMS
from towtank.tank.campaign import tow
from towtank.tank.lpm import LpmTank
from towtank.terms import columns

HOKIE = read_craft("hokie")


def known():
    """Values of either sign and unlike sizes for every term that a 4-fold craft has, with its ties."""
    random = np.random.default_rng(5)
    names = [n for n in STANDING if not TERMS[n].is_added_mass or n in FOURFOLD_ADDED_MASS]
    values = {name: float(random.uniform(0.5, 2.0) * random.choice([-1.0, 1.0])) for name in names}
    return values | {name: sign * values[twin] for name, (twin, sign) in FOURFOLD_TIES.items()}


def test_known_coefficients_come_back_from_the_runs_of_the_standard_plan():
    values = known()
    runs = tow(standard_plan(HOKIE, periods=2, samples=16), LpmTank(values))
    free = [name for name in values if name not in FOURFOLD_TIES]
    matrix, measured = [], []
    for run in runs:
        settled = run.settled
        regressors = {
            name: columns([name], run.history.nu[settled], run.history.nudot[settled], run.control[settled])[..., 0]
            for name in values
        }
        for name, (twin, sign) in FOURFOLD_TIES.items():
            regressors[twin] = regressors[twin] + sign * regressors[name]
        matrix.append(np.stack([regressors[name].ravel() for name in free], axis=1))
        measured.append(run.loads[settled].ravel())
    stacked = np.concatenate(matrix)
    scale = np.linalg.norm(stacked, axis=0)
    found = np.linalg.lstsq(stacked / scale, np.concatenate(measured), rcond=None)[0] / scale
    # Round-off of a problem of condition 100.
    np.testing.assert_allclose(found, [values[name] for name in free], rtol=1e-10)
