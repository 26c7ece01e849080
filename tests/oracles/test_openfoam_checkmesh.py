"""The measures of a mesh against OpenFOAM's own checkMesh. Needs OpenFOAM: make openfoam."""

import re
import subprocess

import numpy as np
import pytest

from towtank.craft.library import read_craft
from towtank.tank.openfoam.find import require
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.mesh.poly import write_mesh
from towtank.tank.openfoam.mesh.quality import quality

HEADER = "FoamFile {{ version 2.0; format ascii; class dictionary; object {}; }}\n"
CONTROL = "startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeInterval 1;\n"
SCHEMES = "ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {} interpolationSchemes {} snGradSchemes {}\n"
NUMBER = r"([-+.\deE]*\d)"

CASES = [
    ("suboff-bare", MeshSettings(40, 12, 16), True, ()),
    ("remus100", MeshSettings(44, 12, 16), False, ()),
    ("suboff-fins", MeshSettings(56, 16, 20), True, (0.0, 0.0, 0.0, 0.0)),
    ("suboff-x", MeshSettings(56, 16, 20), False, (10.0, -20.0, 0.0, 30.0)),
    ("hokie", MeshSettings(56, 16, 20), False, (40.0, 40.0, 40.0, 40.0)),
]


def check_mesh(case) -> str:
    installation = require()
    (case / "system").mkdir()
    for name, text in (("controlDict", CONTROL), ("fvSchemes", SCHEMES), ("fvSolution", "")):
        (case / "system" / name).write_text(HEADER.format(name) + text)
    program = installation.program("checkMesh")
    done = subprocess.run(
        [program, "-case", case], env=installation.surroundings(), capture_output=True, text=True, check=True
    )
    return done.stdout


@pytest.mark.parametrize(("name", "settings", "half", "fins"), CASES, ids=[c[0] for c in CASES])
def test_measures_agree_with_checkmesh(tmp_path, name, settings, half, fins):
    mesh = mesh_of(read_craft(name), settings, half=half, fins=np.radians(fins))
    write_mesh(mesh, tmp_path)
    log, ours = check_mesh(tmp_path), quality(mesh)

    def said(words: str) -> float:
        return float(re.search(words + r"\s*" + NUMBER, log)[1])

    # checkMesh prints six digits.
    assert said(r"\bcells:") == ours.cells
    assert said(r"hexahedra:") == ours.cells
    assert said("Total volume =") == pytest.approx(ours.volume, rel=1e-5)
    assert said("Min volume =") == pytest.approx(ours.least_volume, rel=1e-5)
    assert said("non-orthogonality Max:") == pytest.approx(ours.max_non_orthogonality, rel=1e-5)
    assert said("average:") == pytest.approx(ours.mean_non_orthogonality, rel=1e-5)
    assert said(r"[Mm]ax skewness =") == pytest.approx(ours.max_skewness, rel=1e-5)
    assert said("Max aspect ratio =") == pytest.approx(ours.max_aspect, rel=1e-5)
    severe = re.search(r"severely non-orthogonal \(> 70 degrees\) faces: (\d+)", log)
    assert (int(severe[1]) if severe else 0) == ours.severe
    for fine in ("Boundary definition OK", "Upper triangular ordering OK", "Point usage OK", "Face pyramids OK",
                 "Cell volumes OK", "Number of regions: 1 (OK)"):  # fmt: skip
        assert fine in log
    only_angle = [words for words in ours.verdict() if "orthogonal" not in words]
    assert ("Mesh OK" in log) == (not only_angle)
