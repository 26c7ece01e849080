"""``towtank check``: hydrostatics of a craft and what is doubtful about its file."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

from towtank.cli.options import CraftArgument, Debug, Json, Out
from towtank.cli.reply import BAD_INPUT, answering

if TYPE_CHECKING:
    from towtank.craft.craft import Craft
    from towtank.craft.hydrostatics import Hydrostatics


def check(craft: CraftArgument, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Print hydrostatics and findings of a craft.

    Exit code 2 when the craft cannot be towed as it stands. With --out the solid is written there too (STL and GLB).

    Example: towtank check remus100
    """
    with answering("check", json, debug) as reply:
        from towtank.craft.hydrostatics import check as check_craft
        from towtank.craft.library import read_craft
        from towtank.craft.solid import write_glb, write_stl

        read = read_craft(craft)
        checked = check_craft(read)
        if out is not None:
            for kind, write in (("stl", write_stl), ("glb", write_glb)):
                write(read, out / f"{read.name}.{kind}")
                reply.file(kind, out / f"{read.name}.{kind}")
        findings = [{"severity": f.severity, "where": f.where, "message": f.message} for f in checked.findings]
        reply.summary |= {"craft": read.name, "hydrostatics": _numbers(checked.hydrostatics), "findings": findings}
        reply.say(_text(read, checked.hydrostatics))
        for finding in findings:
            reply.say(f"{finding['severity']:<8} {finding['where']}: {finding['message']}")
        errors = sum(finding["severity"] == "error" for finding in findings)
        if errors:
            reply.fail(BAD_INPUT, f"{errors} finding{'s' if errors > 1 else ''} of severity error in {craft}.")


def _numbers(values: Hydrostatics) -> dict[str, Any]:
    from dataclasses import fields

    return {item.name: getattr(values, item.name) for item in fields(values)}


def _text(craft: Craft, h: Hydrostatics) -> str:
    rows = [
        ("length, diameter", f"{h.length:.4g} m, {h.diameter:.4g} m (ratio {h.slenderness:.3g})"),
        (
            "volume",
            f"{h.volume:.5g} m3 (hull {h.hull_volume:.5g}, fins {h.fin_volume:.3g}, strakes {h.strake_volume:.3g})",
        ),
        ("wetted area", f"{h.wetted_area:.5g} m2 (hull {h.hull_wetted_area:.5g})"),
        ("prismatic coefficient", f"{h.prismatic:.4f}"),
        ("mass", f"{h.mass:.6g} kg"),
        ("displaced mass", f"{h.displaced_mass:.6g} kg of the shape, {h.stated_displaced_mass:.6g} kg in the file"),
        ("net buoyancy", f"{h.net_buoyancy_percent:+.3g} % of the weight"),
        ("centre of buoyancy", f"{h.cb_from_nose:.5g} m aft of the nose"),
        ("CB from origin", "{:.4g}, {:.4g}, {:.4g} m".format(*h.cb)),
        ("CG from origin", "{:.4g}, {:.4g}, {:.4g} m".format(*craft.mass.cg)),
        ("pitch at rest", f"{degrees(h.trim):.3g} deg, bow up positive"),
        ("roll stiffness", f"{h.restoring:.4g} N m/rad"),
        ("Reynolds number", f"{h.reynolds:.3g} at {craft.speed:.4g} m/s"),
        ("fins, strakes", f"{len(craft.fins)}, {len(craft.strakes)}; symmetry {craft.symmetry}"),
    ]
    return "\n".join([craft.title or craft.name, *(f"  {name:<22} {value}" for name, value in rows)])
