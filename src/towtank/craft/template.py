"""The commented craft file that ``towtank new NAME`` writes."""

from __future__ import annotations

import re

from towtank.errors import CraftError

_TEXT = """\
# Craft file of towtank. `towtank check` tells what is wrong with it; docs/craft.md lists every key.
#
# A number is bare (SI units: metres, kilograms, seconds), or text with a unit: "2 in", "15 deg", "3 knot".
# Angles always name their unit. A number may carry where it comes from:
#     mass = {{ value = "52 kg", source = "weighing, dry dock" }}
# source and assumed at the head of a section hold for all its numbers. Write assumed = ["hinge"] for some of them.
# Every number below belongs to an example craft. Replace them, and replace `assumed` by sources as you learn.

[craft]
name  = "{name}"
title = ""                        # one line for the report

[conditions]
assumed = true
speed   = "1.5 m/s"               # reference speed of the captive tests
density = "1026 kg/m^3"           # sea water at 15 C
kinematic_viscosity = "1.19e-6 m^2/s"

[hull]
# kind: "myring" (below), "suboff" (length), "ellipsoid" (length, diameter), or "offsets":
#     kind = "offsets"
#     unit = "m"
#     offsets = [[0.0, 0.0], [0.1, 0.07], [0.4, 0.1], [1.4, 0.1], [2.0, 0.0]]   # [distance aft of the nose, radius]
kind       = "myring"
assumed    = true
nose       = "0.25 m"
middle     = "1.25 m"
tail       = "0.50 m"
diameter   = "0.20 m"
tail_angle = "20 deg"             # half angle of the tail at its point
exponent   = 2                    # of the nose; 2 is an ellipse, more is blunter

[fins]
# layout: "x" or "plus". Or azimuths = ["0 deg", "120 deg", "240 deg"], or count = 3.
# Azimuth 0 is starboard, 90 deg keel, 180 deg port, 270 deg deck. Single, differing fins: one [[fin]] table each.
layout        = "x"
assumed       = true
root_radius   = "0.05 m"          # radii are measured from the hull axis; what lies inside the hull does not count
root_chord    = "0.10 m"
tip_radius    = "0.10 m"
tip_chord     = "0.07 m"
trailing_edge = "1.88 m"          # distance of the root trailing edge aft of the nose
trailing_edge_sweep = "0 deg"     # positive when the tip lies further aft
section       = "0015"            # symmetric NACA four-digit section
hinge         = 0.4               # stock behind the leading edge, fraction of the chord
max_angle     = "25 deg"
max_rate      = "60 deg/s"
time_constant = "0.1 s"
# signs = [1, 1, 1, 1]            # -1 where the vehicle counts a fin angle the other way (docs/craft.md)

# [[strake]]                      # fixed plates along the hull; one table for each shape, layout "x" or "plus",
# layout     = "plus"             # or azimuths = ["90 deg", "270 deg"]
# assumed    = true
# start      = "1.45 m"           # distances aft of the nose
# end        = "1.75 m"
# height     = "0.02 m"           # what stands out of the hull; end_height where it differs at the end
# thickness  = "3 mm"

[mass]
# Mass with the water enclosed in the hull. One of net_buoyancy_percent (signed, negative is heavy), buoyancy
# (a force, or "neutral") and volume.
assumed  = true
mass     = "53.84 kg"
net_buoyancy_percent = 0.5
cg       = {{ x = "cb", y = 0, z = "0.01 m" }}   # from the origin; x forward ("cb": level trim), z down
inertia  = "uniform"              # or ixx, iyy, izz with inertia_about = "cg" or "origin"

# [propeller]                     # without it the thrust equals the resistance at the commanded speed
# diameter = "0.12 m"
# table    = [[0.0, 0.45, 0.07], [0.7, 0.16, 0.03]]   # J, KT, KQ
# wake     = 0.1
# thrust_deduction = 0.1
# torque   = 1                    # sense of its torque on the hull

# [reference]
# origin_from_nose = "0.95 m"     # the centre of buoyancy if left out
"""


def template(name: str) -> str:
    """Text of a craft file for a new craft ``name``. It loads as it is.

    Raises
    ------
    CraftError
        The name cannot be a folder name.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        raise CraftError(
            f"craft name {name!r} cannot be used: it names files and folders. "
            "Use letters, digits, dot, dash and underscore, and begin with a letter or digit."
        )
    return _TEXT.format(name=name)
