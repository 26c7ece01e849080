"""Reading a model and asking it for its rates loads numpy and the standard library, nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft, Fin, Mass, Propeller
from towtank.craft.hull import Myring
from towtank.model.equations import Model
from towtank.model.files import write_model

HEAVY = ("scipy", "pydantic", "pint", "xarray", "matplotlib", "trimesh", "h5py", "rich", "typer", "casadi")
"""Libraries of other stages; scipy alone takes longer to import than a run of 600 s takes on the engine."""

CODE = """
import json, sys, time
clock = time.perf_counter
start = clock(); import numpy; bare = clock() - start
start = clock()
import towtank as tt
model = tt.read_model(sys.argv[1])
rates = model.rates([0.0] * 6 + [1.0] + [0.0] * 9, [0.1] * 4, model.thrust(1.0))
own = clock() - start
from towtank.model.algebra import MATH
from towtank.model.equations import right_hand_side_quaternion
right_hand_side_quaternion(
    model.constants, [0.0] * 3 + [1.0] + [0.0] * 3 + [1.0] + [0.0] * 9, [0.1] * 4, 1.0, (0.0, 0.0, 0.0), MATH
)
roots = sorted({name.partition(".")[0] for name in sys.modules})
print(json.dumps({"roots": roots, "rates": rates, "numpy": bare, "own": own}))
"""

TABLE = ((0.0, 0.45, 0.07), (0.4, 0.3, 0.05), (0.8, 0.1, 0.02), (1.0, -0.05, 0.0))
VALUES = {"Xudot": -30.0, "Yvdot": -900.0, "Zwdot": -900.0, "Mqdot": -1000.0, "Nrdot": -1000.0, "Xuu": -15.0}


def _model(propeller):
    fins = tuple(Fin(f"fin{i}", np.radians(a), 0.1, 0.4, 0.4, 0.3, 4.8) for i, a in enumerate((225, 315, 135, 45)))
    body = Mass(900.0, 900.0, (0.0, 0.0, 0.05), ((20.0, 0.0, 0.0), (0.0, 1200.0, 0.0), (0.0, 0.0, 1200.0)))
    hull = Myring(1.0, 3.0, 1.0, 0.6, 0.4)
    return Model.from_values(Craft("case", hull, fins, body, 2.5, 1.5, propeller=propeller), VALUES)


def test_reading_a_model_and_running_it_imports_no_library_beside_numpy(tmp_path: Path, record_property):
    """The centre of buoyancy stands in the file, so no hull is integrated again."""
    for name, propeller in (("plain", Propeller()), ("screw", Propeller(0.3, 4.9, table=TABLE))):
        tested = _model(propeller)
        path = write_model(tested, tmp_path / f"{name}.json")
        done = subprocess.run([sys.executable, "-c", CODE, str(path)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        assert set(found["roots"]) & set(HEAVY) == set()
        assert found["rates"] == tested.rates([0.0] * 6 + [1.0] + [0.0] * 9, [0.1] * 4, tested.thrust(1.0))
        # the engine's limit is numpy + 0.15 s to a finished run; time on a shared machine is shown, not asserted
        print(f"{name}: numpy {found['numpy']:.3f} s, towtank and the model {found['own']:.3f} s")
        record_property(f"seconds over numpy, {name}", found["own"])
