"""Commented mapping files to edit, one for each format."""

from __future__ import annotations

from towtank.errors import InputError
from towtank.tank.imported.mapping import FORMATS, LEVELS

_HEAD = """\
# Mapping of runs made elsewhere, for `towtank import`. Every key: docs/import.md.
# Keys up here hold for every [[run]]; a run's own come first. A bare number is SI; a bare angle is refused.
schema = "towtank/import/1"
craft = "hokie"              # a craft of the library, or a craft.toml: length, origin and fins come from it
format = "{form}"
level = "{level}"               # {levels}
speed = "1 m/s"              # reference (carriage) speed in the file
density = "997 kg/m^3"       # of the water in the file; loads are brought to that of the craft

# The file's axes that point forward, to starboard and down.
axes = {axes}
{frame}
# The point of the moments, without which they are worth nothing. One of
#   {{ from_nose = "3 m", y = "0 m", z = "0 m" }}   aft of the nose, on or off the axis (body axes)
#   {{ point = ["1 m", "0 m", "0 m"], nose = ["0 m", "0 m", "0 m"] }}   both in the coordinates of the file
#   "origin"   the body origin of the craft
moment_point = {point}
"""

_STAR = """
# Headers of the export, in full or without "Monitor: ... (unit)". Units in brackets are read. Time is "Physical Time",
# or "Iteration" in a steady run. Names on the left are along and about the axes of the file.
[columns]
X = "Force X"
Y = "Force Y"
Z = "Force Z"
K = "Moment X"
M = "Moment Y"
N = "Moment Z"
"""

_CSV = """
# Headers of the file. Where a header holds no unit, state it: X = { name = "Fx", unit = "kN" }.
# Names on the left are along and about the axes of the file. Motion: x y z phi theta psi, u v w p q r, udot ... rdot.
[columns]
time = "t"
X = { name = "Fx", unit = "N" }
Y = { name = "Fy", unit = "N" }
Z = { name = "Fz", unit = "N" }
K = { name = "Mx", unit = "N*m" }
M = { name = "My", unit = "N*m" }
N = { name = "Mz", unit = "N*m" }
"""

_MAT = """
# Variables of the file: fields of structures with a dot, elements of structure arrays with a number from 1.
# Names on the left are along and about the axes of the file. Motion: x y z phi theta psi, u v w p q r, udot ... rdot.
[columns]
time = "run.t"
X = { name = "run.Fx", unit = "N" }
Y = { name = "run.Fy", unit = "N" }
Z = { name = "run.Fz", unit = "N" }
K = { name = "run.Mx", unit = "N*m" }
M = { name = "run.My", unit = "N*m" }
N = { name = "run.Mz", unit = "N*m" }
"""

_RUNS = """
# One table for each run. kind: drift, incidence (angle), turn (rate, drift), sway, yaw, heave, pitch, roll, surge
# (amplitude, frequency, and phase at the time zero of the file: displacement = amplitude sin(frequency t + phase)), or
# free. With from = "columns" the motion is taken from mapped columns.
[[run]]
name = "drift-p04"
file = "{drift}"
motion = {{ kind = "drift", angle = "4 deg" }}
# window = {{ last = 0.5 }}    # share of the record that is averaged; or start and end

[[run]]
name = "sway-w0.2"
file = "{sway}"
motion = {{ kind = "sway", amplitude = "0.8 m", frequency = "0.2 rad/s", phase = "0 deg" }}
# fins = {{ upper = "5 deg" }}                          # names of the craft's fins, right-handed about the span
# half_model = "xz"                                   # the plane the model is cut at
# scale = {{ lambda = 3.4, speed = "froude" }}          # model 1:lambda; or the speed that is wanted at full size
# measured = "balance on craft"                       # "water on craft" (computed) is what is taken otherwise
# includes = ["weight", "buoyancy", "inertia"]        # of the body, to be taken out; needs body
# body = "craft"                                      # or mass, displaced_mass, cg, cb, inertia of the model
# mesh = {{ label = "medium", cells = 4200000 }}        # for `towtank grid`
# exploratory = true                                  # recorded, never fitted
"""

_FRAME = """\
frame = "body"               # "body": axes move with the craft; "inertial": they stay, and loads are turned
"""
_FOAM_FRAME = """\
# Axes of the case do not move: "inertial" unless the mesh stands still and the flow is turned ("body").
frame = "inertial"
# fixed: what the CofR stays with. OpenFOAM keeps it where it is in the case: "carriage" when the case moves with the
# towing speed, "water" when the mesh moves through water at rest, "body" when the mesh does not move.
"""


def template(form: str) -> str:
    """A mapping to edit for files of ``form``, a word of ``FORMATS``.

    Raises
    ------
    InputError
        No such format.
    """
    if form not in FORMATS:
        raise InputError(f"--template {form!r} is unknown. Write one of {', '.join(FORMATS)}.")
    foam = form == "openfoam"
    head = _HEAD.format(
        form=form,
        level="experiment" if form in ("csv", "mat", "netcdf") else "rans",
        levels=", ".join(LEVELS),
        axes='["-x", "y", "-z"]' + "     # x aft, y starboard, z up",
        frame=_FOAM_FRAME if foam else _FRAME,
        point='{ nose = ["0 m", "0 m", "0 m"], fixed = "carriage" }   # the point itself is the CofR in the file'
        if foam
        else '{ from_nose = "3 m" }',
    )
    columns = {"star": _STAR, "csv": _CSV, "netcdf": _CSV, "mat": _MAT, "openfoam": ""}[form]
    ending = {"star": ".csv", "csv": ".csv", "netcdf": ".nc", "mat": ".mat", "openfoam": "/postProcessing/forces"}[form]
    return head + columns + _RUNS.format(drift=f"drift-p04{ending}", sway=f"sway-w0.2{ending}")
