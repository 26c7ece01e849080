"""What strakes must obey in the fast tank and in the craft file, whatever their constants."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank import read_craft
from towtank.craft.build import build as craft_of
from towtank.craft.craft import Craft, Strake
from towtank.craft.hydrostatics import check, hydrostatics
from towtank.craft.reading import read_toml
from towtank.craft.solid import enclosed, solid, write_stl
from towtank.craft.template import template
from towtank.errors import CraftError, InputError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift
from towtank.plan.standard import standard_plan
from towtank.progress import Silent
from towtank.tank.fast.build import build
from towtank.tank.fast.constants import CONSTANTS, STRAKES, sample
from towtank.tank.fast.motion import MotionRecord
from towtank.tank.fast.tank import FastTank
from towtank.tank.identity import run_id
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.tank import OpenFoamTank

TANK = FastTank(members=0)
X_FINS = read_craft("suboff-x")
SPEEDS, RATES = st.floats(-2.0, 3.0), st.floats(-0.5, 0.5)


def straked(height: float = 0.04, end_height: float | None = None, first: float = 0.0, count: int = 4) -> Craft:
    turned = [(first + 2.0 * np.pi * i / count) % (2.0 * np.pi) for i in range(count)]
    end = height if end_height is None else end_height
    strakes = tuple(Strake(f"s{i}", a, 3.0, 3.75, height, end, 0.005) for i, a in enumerate(turned))
    return replace(X_FINS, strakes=strakes)


def steady(craft: Craft, nu: np.ndarray) -> dict[str, np.ndarray]:
    """Parts of the quasi-steady load, each (n, 6); every second sample is at rest, so that there is no memory."""
    still = np.zeros((2 * len(nu), 6))
    still[::2] = nu
    record = MotionRecord(np.arange(2.0 * len(nu)), still, 0.0 * still, np.zeros((len(still), len(craft.fins))))
    return {k: v[0, ::2] for k, v in TANK.part_loads(build(craft, craft.speed), record).items()}


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS, RATES, RATES, RATES))
@settings(max_examples=80, deadline=None)
@pytest.mark.parametrize("craft", [straked(), straked(0.08, 0.01), straked(0.01, 0.08), straked(0.05, count=1)])
def test_viscous_loads_with_strakes_take_energy(craft: Craft, nu: tuple[float, ...]) -> None:
    velocity = np.array([nu])
    parts = steady(craft, velocity)
    assert sum(parts[k][0] @ velocity[0] for k in ("tail", "crossflow", "drag", "fins", "strakes")) <= 1e-9


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS, RATES, RATES, RATES))
@settings(max_examples=40, deadline=None)
def test_a_quarter_turn_and_a_mirror_turn_the_load(nu: tuple[float, ...]) -> None:
    turn = np.zeros((6, 6))
    for block in (0, 3):  # y -> z, z -> -y
        turn[block, block] = turn[block + 2, block + 1] = 1.0
        turn[block + 1, block + 2] = -1.0
    mirror = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    load = steady(straked(), np.array([nu]))["strakes"][0]
    for change in (turn, mirror):
        turned = steady(straked(), (change @ np.array(nu))[None])["strakes"][0]
        assert turned == pytest.approx(change @ load, rel=1e-9, abs=1e-9 * np.abs(load).max() + 1e-9)


def test_in_small_drift_the_azimuth_of_four_strakes_does_not_matter() -> None:
    nu = np.array([[3.0, 3e-5, 0.0, 0.0, 0.0, 1e-5]])
    plus, cross = (steady(straked(first=a), nu)["strakes"][0] for a in (0.0, 0.25 * np.pi))
    # The separated part, of second order, differs: at v / u = 1e-3 by 2 % of the side force, here by a hundredth of it.
    assert cross[1] == pytest.approx(plus[1], rel=1e-3)
    assert cross[5] == pytest.approx(plus[5], rel=1e-2)


def test_lower_strakes_do_less_and_none_does_nothing() -> None:
    nu = np.array([[3.0, 0.4, 0.1, 0.2, 0.02, 0.05]])
    loads = [np.abs(steady(straked(h), nu)["strakes"][0]) for h in (0.04, 0.004, 0.0004)]
    assert np.all(loads[0] > loads[1])
    assert np.all(loads[1] > loads[2])
    # Friction goes with the height, lift with its square; the hull's separation grows linearly at first, then no more.
    assert np.all(loads[2] < 0.05 * loads[0])
    assert "strakes" not in steady(X_FINS, nu)
    assert steady(replace(straked(), strakes=()), nu)["fins"] == pytest.approx(steady(X_FINS, nu)["fins"], abs=0.0)


def test_strakes_in_line_with_the_fins_take_their_flow_and_between_them_less() -> None:
    nu = np.array([[3.0, 0.03, 0.0, 0.0, 0.0, 0.0]])
    alone = steady(X_FINS, nu)["fins"][0, 1]
    between, in_line = (steady(straked(0.06, first=a), nu)["fins"][0, 1] for a in (0.0, 0.25 * np.pi))
    assert abs(in_line) < abs(between) < abs(alone)


def test_a_longer_strake_of_one_height_adds_no_lift_in_drift_but_damps_more_when_drifting_far() -> None:
    """Slender-body theory: the lift is the momentum at the widest end, wherever the strake begins."""
    hull = read_craft("hokie")

    def side(length: float, v: float) -> float:
        strakes = tuple(Strake(f"s{a}", np.radians(a), 5.8 - length, 5.8, 0.1, 0.1, 0.01) for a in (90.0, 270.0))
        body = build(replace(hull, fins=(), strakes=strakes), hull.speed)
        nu = np.array([[1.0, v, 0.0, 0.0, 0.0, 0.0]])
        record = MotionRecord(np.zeros(1), nu, 0.0 * nu, np.zeros((1, 0)))
        return float(TANK.part_loads(body, record)["strakes"][0, 0, 1])

    # On the cylinder; the hull's layer, slenderness and sidewash change a little with the length.
    assert side(3.0, 1e-4) == pytest.approx(side(1.5, 1e-4), rel=0.15)
    assert side(3.0, 0.3) == pytest.approx(2.0 * side(1.5, 0.3), rel=0.15)


def test_the_constants_of_strakes_are_drawn_beside_the_others_and_spread_their_load() -> None:
    drawn = sample(24, 3)
    assert set(drawn) == {c.name for c in (*CONSTANTS, *STRAKES)}
    for item in STRAKES:
        assert np.log(drawn[item.name][1:]).std() == pytest.approx(item.spread, rel=0.15)
    run = FastTank(members=24).run(straked(), CaptiveTest("drift", 3.0, Drift(3.0, np.radians(6.0))), Silent())
    assert run.ensemble is not None
    assert "strakes" in run.parts
    assert sum(run.parts.values()) == pytest.approx(run.loads, rel=1e-9, abs=1e-6)


def test_a_run_is_known_by_its_strakes() -> None:
    test = CaptiveTest("drift", 3.0, Drift(3.0, 0.1))
    names = {run_id(craft, test, TANK) for craft in (X_FINS, straked(), straked(0.05), straked(0.05, first=0.1))}
    assert len(names) == 4


def test_strakes_outside_the_range_of_the_theory_are_flagged_and_remarked() -> None:
    short = replace(X_FINS, strakes=(Strake("stub", 1.5, 3.3, 3.5, 0.15, 0.15, 0.005),))
    test = CaptiveTest("drift", 3.0, Drift(3.0, 0.1))
    assert any("aspect ratio" in flag for flag in TANK.run(short, test, Silent()).flags)
    assert any("may lie in the layer" in flag for flag in TANK.run(straked(0.004), test, Silent()).flags)
    assert not any("strakes" in flag for flag in TANK.run(straked(), test, Silent()).flags)
    assert [f.severity for f in check(short).findings if f.where == "strake"] == ["warning", "note"]


# -- the craft file ----------------------------------------------------------------------------------------------------

TABLE = """[[strake]]
layout = "plus"
start = "1.45 m"
end = "1.75 m"
height = "0.02 m"
end_height = "30 mm"
thickness = "3 mm"
assumed = ["thickness"]
source = "drawing 7"
"""


def written(*changes: tuple[str, str], table: str = TABLE) -> Craft:
    for pattern, replacement in changes:
        table, hits = re.subn(pattern, replacement, table)
        assert hits, pattern
    text = re.sub(r"^\[mass\]", table + "[mass]", template("probe"), flags=re.MULTILINE)
    return craft_of(read_toml(text, "probe"), "probe")


def test_a_craft_file_gives_strakes_with_their_sources() -> None:
    craft = written()
    assert [round(np.degrees(s.azimuth)) for s in craft.strakes] == [0, 90, 180, 270]
    assert {(s.start, s.end, s.height, s.end_height, s.thickness) for s in craft.strakes} == {
        (1.45, 1.75, 0.02, 0.03, 0.003)
    }
    assert "strake[1].thickness" in craft.assumed
    assert dict(craft.sources)["strake[1]"] == "drawing 7"
    single = written((r'layout = "plus"', 'azimuths = ["90 deg"]'))
    assert [s.name for s in single.strakes] == ["strake"]
    assert (single.symmetry, written().symmetry) == ("port-starboard", "fourfold")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((r'"1.75 m"', '"1.40 m"'), "is not behind start"),
        ((r'"1.75 m"', '"2.40 m"'), "behind the tail"),
        ((r'"1.75 m"', '"1.999 m"'), "more than the radius of the hull"),
        ((r'layout = "plus"\nstart = "1.45 m"\nend = "1.75 m"', 'layout = "x"\nstart = "1.45 m"\nend = "1.8 m"'),
         "where fin top-port turns"),
        ((r'layout = "plus"', 'azimuths = ["90 deg", "450 deg"]'), "stand in one place"),
        ((r'layout = "plus"', "azimuths = []"), "the list is empty"),
        ((r'layout = "plus"', 'layout = "plus"\nazimuths = ["0 deg"]'), "given together"),
        ((r'layout = "plus"\n', ""), "none of layout, azimuths"),
        ((r'"0.02 m"', '"-2 cm"'), "is not positive"),
        ((r'height = "0.02 m"', 'heigth = "0.02 m"'), "Did you mean height"),
        ((r"\[\[strake\]\]", "[strake]"), "with double brackets"),
    ],
)  # fmt: skip
def test_strakes_that_cannot_stand_are_refused_with_the_reason(change: tuple[str, str], words: str) -> None:
    with pytest.raises(CraftError, match=re.escape(words)):
        written(change)


def test_two_tables_need_two_names() -> None:
    second = TABLE.replace("1.45", "1.0").replace("1.75", "1.4")
    with pytest.raises(CraftError, match="Give each"):
        written(table=TABLE + second)
    assert len(written(table=TABLE + second.replace("layout", 'name = "fore"\nlayout')).strakes) == 8


def test_solid_hydrostatics_and_quadrature_agree(tmp_path: Path) -> None:
    craft = straked(0.03, 0.06)
    bare, with_strakes, mesh = hydrostatics(X_FINS), hydrostatics(craft), solid(craft)
    volume, centroid, area = enclosed(mesh)
    assert with_strakes.strake_volume == pytest.approx(4 * 0.75 * 0.045 * 0.005, rel=1e-9)
    assert with_strakes.volume - bare.volume == pytest.approx(with_strakes.strake_volume, rel=1e-6)
    assert volume == pytest.approx(with_strakes.volume, rel=2e-3)
    assert area == pytest.approx(with_strakes.wetted_area, rel=2e-3)
    assert centroid == pytest.approx(with_strakes.cb, abs=2e-4 * craft.length)
    assert trimesh.load(write_stl(craft, tmp_path / "s.stl")).is_watertight
    outer = float(np.hypot(mesh.vertices[:, 1], mesh.vertices[:, 2]).max())
    assert outer == pytest.approx(craft.reach, rel=1e-3)


def test_openfoam_refuses_strakes_and_says_what_to_do(tmp_path: Path) -> None:
    craft = straked()
    plan = standard_plan(craft)
    with pytest.raises(InputError, match=r"4 strakes.*5 mm thick.*fast tank"):
        OpenFoamTank(where=tmp_path).run(craft, plan.tests[0], Silent())
    with pytest.raises(InputError, match="towtank import"):
        OpenFoamTank(where=tmp_path).schedule(craft, plan.tests)
    with pytest.raises(InputError, match=r"\[\[strake\]\]"):
        mesh_of(craft, MeshSettings(), half=False)
    assert list(tmp_path.iterdir()) == []
