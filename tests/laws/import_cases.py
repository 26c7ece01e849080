"""Runs of known coefficients written as others would write them: what the tests of ``imported`` are built on.

Nothing here is measured: ``LpmTank`` gives the loads, and the writers turn them into the axes, point, scale and share
that a mapping then has to undo.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from derive_synthetic import ROLL

from synthetic_craft import SUBOFF, values
from towtank.craft.library import read_craft
from towtank.derive.select import allowed
from towtank.frames import move_load, rotation
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Heave, Sway
from towtank.plan.standard import standard_plan
from towtank.progress import Silent
from towtank.symbols import FOURFOLD_TIES, LOADS, TERMS
from towtank.tank.lpm import LpmTank

HOKIE = read_craft("hokie")
STAR_AXES = np.diag([-1.0, 1.0, -1.0])
"""Components along x aft, y starboard, z up of a vector in body axes."""

HEAD = """\
schema = "towtank/import/1"
craft = "hokie"
level = "known coefficients"
format = "{form}"
speed = "{speed!r} m/s"
density = "{density!r} kg/m^3"
axes = {axes}
"""


def known(seed: int = 5) -> dict[str, float]:
    """Natural values for every term of a 4-fold craft, with its ties; primes of 0.5 to 2 %."""
    random = np.random.default_rng(seed)
    names = [name for name in allowed("fourfold") if name not in ROLL]
    scale = {n: TERMS[n].prime_factor(HOKIE.water.density, HOKIE.length, HOKIE.speed) for n in names}
    found = {n: scale[n] * -float(random.uniform(0.005, 0.02)) for n in names}
    found["Nvdot"] = found["Yrdot"]
    return found | {name: sign * found[twin] for name, (twin, sign) in FOURFOLD_TIES.items() if name in found}


def plan(samples: int = 32):
    """The standard plan of two periods, without its exploratory runs."""
    made = standard_plan(HOKIE, periods=2, samples=samples)
    return replace(made, tests=tuple(t for t in made.tests if not t.exploratory))


def halved(test) -> bool:
    """True for a run whose flow is symmetric about the xz plane."""
    straight = test.motion == Drift(test.speed, 0.0) and not any(test.fins)
    return straight or test.kind in ("heave", "pitch", "surge")


def runs_of(made, coefficients):
    tank = LpmTank(coefficients)
    return [tank.run(HOKIE, test, Silent()) for test in made.tests]


def motion_text(test, length=1.0, speed=1.0) -> str:
    """The motion of a test as a mapping defines it, of a model 1:``length`` at ``speed`` times the speed; 17 digits."""
    amplitude = ("rad", 1.0) if test.motion.kind == "roll" else ("m", 1.0 / length)
    rate, angle = ("rad/s", length * speed), ("rad", 1.0)
    units = {"amplitude": amplitude, "frequency": rate, "angle": angle, "rate": rate, "drift": angle}
    numbers = [
        f'{key} = "{getattr(test.motion, key) * factor!r} {unit}"'
        for key, (unit, factor) in units.items()
        if hasattr(test.motion, key)
    ]
    return "{ " + ", ".join([f'kind = "{test.motion.kind}"', *numbers]) + " }"


def fins_text(test) -> str:
    angles = test.fins or (0.0,) * len(HOKIE.fins)
    return "{ " + ", ".join(f'{f.name} = "{a!r} rad"' for f, a in zip(HOKIE.fins, angles, strict=True)) + " }"


def seen(run, *, matrix=STAR_AXES, point=(0.0, 0.0, 0.0), half=False, length=1.0, speed=1.0, density=1.0):
    """Time and loads (N, 6) of a run along other axes, about ``point`` (from the origin, body axes, full size).

    length, speed, density : of a model 1:``length`` at ``speed`` times the speed in water of ``density`` times that.
    """
    force = density * speed**2 / length**2
    loads = move_load(run.loads, np.array(point)) * np.array([force] * 3 + [force / length] * 3)
    loads = np.concatenate([loads[:, :3] @ matrix.T, loads[:, 3:] @ matrix.T], axis=1)
    if half:
        # Shares of one half: half of X Z M; of Y K N something that the other half cancels.
        loads = loads * np.array([0.5, 0.0, 0.5, 0.0, 0.5, 0.0])
        loads[:, [1, 3, 5]] = 0.3 * np.abs(loads[:, [0]]) + 1.0
    return run.history.time / (length * speed), loads


def star_csv(path: Path, time, loads, units=("N", "N-m"), clock="Physical Time: Physical Time (s)", digits=17):
    """A monitor export of STAR-CCM+: quoted headers with units in brackets, 17 digits unless told otherwise."""
    names = [f"Force {a}" for a in "XYZ"] + [f"Moment {a}" for a in "XYZ"]
    heads = [clock, *(f"{n} Monitor: {n} Monitor ({units[i // 3]})" for i, n in enumerate(names))]
    rows = [",".join(f'"{head}"' for head in heads)]
    rows += [",".join(f"{v:.{digits}g}" for v in (t, *row)) for t, row in zip(time, loads, strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


STAR_COLUMNS = "\n[columns]\n" + "".join(
    f'{name} = "{what}"\n'
    for name, what in zip(LOADS, [f"{w} {a}" for w in ("Force", "Moment") for a in "XYZ"], strict=True)
)


def forces_dat(path: Path, time, loads, centre=(0.0, 0.0, 0.0)) -> Path:
    """The layout with nested brackets; pressure and viscous shares that add up to the load."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [
        "# Forces",
        f"# CofR                : ({centre[0]:.17g} {centre[1]:.17g} {centre[2]:.17g})",
        "# Time                forces(pressure viscous) moment(pressure viscous)",
    ]
    for t, row in zip(time, loads, strict=True):
        shares = [" ".join(f"{s * v:.17g}" for v in part) for part in (row[:3], row[3:]) for s in (0.75, 0.25)]
        lines.append(f"{t:.17g} (({shares[0]}) ({shares[1]})) (({shares[2]}) ({shares[3]}))")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def force_and_moment(folder: Path, time, loads, centre=(0.0, 0.0, 0.0), brackets=False, digits=17) -> Path:
    """The layout with a file for each of force and moment, columns total, pressure, viscous."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, part in (("force", loads[:, :3]), ("moment", loads[:, 3:])):
        heads = [f"{what}_{axis}" for what in ("total", "pressure", "viscous") for axis in "xyz"]
        lines = [f"# {name.title()}", f"# CofR : ({centre[0]:.17g} {centre[1]:.17g} {centre[2]:.17g})", "#"]
        lines.append("# Time " + " ".join(heads))
        for t, row in zip(time, part, strict=True):
            cells = [" ".join(f"{s * v:.{digits}g}" for v in row) for s in (1.0, 0.75, 0.25)]
            cells = [f"({cell})" for cell in cells] if brackets else cells
            lines.append(f"{t:.{digits}g} {' '.join(cells)}")
        (folder / f"{name}.dat").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def inertial(run, point):
    """Loads (N, 6) along world axes about a point that the carriage holds at ``point`` (from the origin at rest)."""
    turn = rotation(run.history.attitude)
    shift = run.history.position - np.outer(run.speed * run.history.time, [1.0, 0.0, 0.0])
    arm = np.einsum("nji,nj->ni", turn, np.array(point) - shift)
    body = np.concatenate([run.loads[:, :3], run.loads[:, 3:] - np.cross(arm, run.loads[:, :3])], axis=1)
    return np.concatenate(
        [np.einsum("nij,nj->ni", turn, body[:, :3]), np.einsum("nij,nj->ni", turn, body[:, 3:])], axis=1
    )


README = """\
Sample files in the layouts of STAR-CCM+, OpenFOAM and spreadsheets. No such program made them: `write_samples` in
tests/laws/import_cases.py writes them from known coefficients through LpmTank, and a test compares them with what it
writes. The head of each mapping says what it has to undo.
"""


def write_samples(folder: Path) -> None:
    """The files of tests/data/import: a mapping for each format, with runs of Hokie at 1 m/s."""
    tank = LpmTank(values(SUBOFF, HOKIE))
    motions = {
        "drift-p08": Drift(1.0, float(np.radians(8.0))), "straight": Drift(1.0, 0.0), "sway": Sway(1.0, 0.8, 0.2),
        "heave": Heave(1.0, 0.8, 0.2),
    }  # fmt: skip
    runs = {
        name: tank.run(HOKIE, CaptiveTest(name, 1.0, motion, periods=2, samples=24), Silent())
        for name, motion in motions.items()
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "README.md").write_text(README, encoding="utf-8")
    point = (HOKIE.origin_from_nose - 3.0, 0.0, 0.0)
    decay = np.exp(-np.arange(40) / 4.0)[:, None]
    for name in ("drift-p08", "straight"):
        _, loads = seen(runs[name], point=point, half=name == "straight")
        star_csv(folder / f"{name}.csv", np.arange(1, 41), loads[0] * (1.0 + decay), clock="Iteration", digits=8)
    for name in ("sway", "heave"):
        star_csv(folder / f"{name}.csv", *seen(runs[name], point=point, half=name == "heave"), digits=8)
    head = HEAD.format(form="star", speed=1.0, density=HOKIE.water.density, axes='["-x", "y", "-z"]')
    head += 'moment_point = { from_nose = "3 m" }\n' + STAR_COLUMNS
    text = "# x aft, z up, moments about a point 3 m aft of the nose; two runs are half models.\n" + head
    for name, run in runs.items():
        half = 'half_model = "xz"\n' if name in ("straight", "heave") else ""
        steady = "window = { last = 0.25 }\n" if run.steady else ""
        motion = motion_text(CaptiveTest(name, 1.0, motions[name]))
        text += f'\n[[run]]\nname = "{name}"\nfile = "{name}.csv"\nmotion = {motion}\n{half}{steady}'
    (folder / "star.toml").write_text(text, encoding="utf-8")
    _openfoam_sample(folder, runs["sway"], motions["sway"])
    _sheet_sample(folder, runs["sway"])


def _openfoam_sample(folder: Path, run, motion) -> None:
    loads, time = inertial(run, (0.0, 0.0, 0.0)), run.history.time
    loads = np.concatenate([loads[:, :3] @ STAR_AXES.T, loads[:, 3:] @ STAR_AXES.T], axis=1)
    nose = [-HOKIE.origin_from_nose, 0.0, 0.0]
    for start, rows in (("0", slice(0, 30)), ("31.4", slice(24, None))):
        place = folder / "case" / "postProcessing" / "forces" / start
        force_and_moment(place, time[rows], loads[rows], digits=8)
    text = "# Inertial axes, x aft, z up; CofR at the origin of the towed case; one restart that overlaps.\n"
    text += HEAD.format(form="openfoam", speed=1.0, density=HOKIE.water.density, axes='["-x", "y", "-z"]')
    text += f'frame = "inertial"\nmoment_point = {{ nose = {[f"{x!r} m" for x in nose]}, fixed = "carriage" }}\n'
    text += f'\n[[run]]\nname = "sway"\nfile = "case"\nmotion = {motion_text(CaptiveTest("sway", 1.0, motion))}\n'
    (folder / "openfoam.toml").write_text(text, encoding="utf-8")


def _sheet_sample(folder: Path, run) -> None:
    loads, history = run.loads / 1000.0, run.history
    rows = ["Zeit [s];Y [mm];V [mm/s];" + ";".join(f"{name} [{unit}]" for name, unit in SHEET)]
    for i, time in enumerate(history.time):
        cells = [time, 1e3 * history.position[i, 1], 1e3 * history.nu[i, 1], *loads[i]]
        rows.append(";".join(f"{cell:.9g}".replace(".", ",") for cell in cells))
    (folder / "sheet.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    text = "# Semicolons, decimal commas, kN and mm; the motion is taken from the columns.\n"
    text += HEAD.format(form="csv", speed=1.0, density=HOKIE.water.density, axes='["x", "y", "z"]')
    text += 'moment_point = "origin"\n\n[columns]\ntime = "Zeit"\ny = "Y"\nv = "V"\n'
    text += "".join(f'{load} = "{name}"\n' for load, (name, _) in zip(LOADS, SHEET, strict=True))
    text += '\n[[run]]\nname = "sway"\nfile = "sheet.csv"\n'
    text += 'motion = { kind = "sway", frequency = "0.2 rad/s", from = "columns" }\n'
    (folder / "sheet.toml").write_text(text, encoding="utf-8")


SHEET = [(f"F{a}", "kN") for a in "xyz"] + [(f"M{a}", "kN*m") for a in "xyz"]
