"""A plan for another tank: motion tables, a STAR-CCM+ macro, and the mapping that brings the runs back."""

from __future__ import annotations

import json
from pathlib import Path

from towtank.artefact import write_text
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.macro import CLASS, MONITORS, PLOT, star_macro
from towtank.plan.tables import write_motion_tables
from towtank.symbols import LOADS
from towtank.tank.imported.mapping import SCHEMA

_HEAD = """\
# Mapping of the runs that {name}.java makes, for `towtank import`. Every key: docs/import.md.
# Edit axes and moment_point to those of the reports in the plot "{plot}". Bare numbers are SI.
schema = "{schema}"
craft = {craft}
format = "star"
level = "rans"
speed = "{speed!r} m/s"
density = "{density!r} kg/m^3"
axes = ["x", "y", "z"]       # ["-x", "y", "-z"] for x aft and z up
frame = "body"
moment_point = "origin"      # or {{ from_nose = "3 m" }}

[columns]
{columns}
"""
_UNITS = {"amplitude": "m", "frequency": "rad/s", "angle": "rad", "rate": "rad/s", "drift": "rad"}


def write_export(plan: Plan, folder: Path, craft: str) -> dict[str, Path]:
    """Write ``motions/<test>.csv``, the macro and ``import.toml`` into ``folder``; noun -> path.

    craft : name of the library or path, from ``folder``, that the mapping takes the craft from.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    folder = Path(folder)
    write_motion_tables(plan, folder / "motions")
    return {
        "motions": folder / "motions",
        "macro": write_text(folder / f"{CLASS}.java", star_macro(plan)),
        "mapping": write_text(folder / "import.toml", mapping_text(plan, craft)),
    }


def mapping_text(plan: Plan, craft: str) -> str:
    """The mapping, as TOML, of the monitor files that the macro of ``plan`` exports."""
    columns = "\n".join(f'{load} = "{name}"' for load, name in zip(LOADS, MONITORS, strict=True))
    head = _HEAD.format(
        name=CLASS,
        plot=PLOT,
        schema=SCHEMA,
        craft=json.dumps(craft),
        speed=plan.speed,
        density=plan.craft.water.density,
        columns=columns,
    )
    return head + "".join(_run(plan, test) for test in plan.tests)


def _run(plan: Plan, test: CaptiveTest) -> str:
    motion = [f'kind = "{test.motion.kind}"']
    for key, unit in _UNITS.items():
        if hasattr(test.motion, key):
            unit = "rad" if (test.motion.kind, key) == ("roll", "amplitude") else unit
            motion.append(f'{key} = "{getattr(test.motion, key)!r} {unit}"')
    lines = ["", "[[run]]", f"name = {json.dumps(test.name)}", f"file = {json.dumps(f'monitors/{test.name}.csv')}"]
    lines.append(f"motion = {{ {', '.join(motion)} }}")
    if any(test.fins):
        angles = zip(plan.craft.fins, test.fins, strict=True)
        lines.append("fins = { " + ", ".join(f'{json.dumps(f.name)} = "{angle!r} rad"' for f, angle in angles) + " }")
    if test.speed != plan.speed:
        lines.append(f'speed = "{test.speed!r} m/s"')
    if not test.motion.period:
        lines.append("window = { last = 0.25 }")
    if test.exploratory:
        lines.append("exploratory = true")
    return "\n".join(lines) + "\n"
