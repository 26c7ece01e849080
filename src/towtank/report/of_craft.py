"""Page section: the craft and the conditions."""

from __future__ import annotations

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.hydrostatics import Finding, check
from towtank.errors import TowtankError
from towtank.figures import shape
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook, view
from towtank.report.study import STAGES, Study

GEOMETRY = "none stated; numbers are as given in the craft file"


def craft(study: Study, book: Sketchbook) -> Section:
    """Principal particulars, hydrostatics, fins, strakes, remarks of the check, drawings and the 3-D view."""
    if study.craft is None:
        return Section("craft", "Craft and conditions", (missing("No craft was given.", STAGES["craft"]),))
    it = study.craft
    blocks: list[Block] = [Text(words) for words in study.remarks]
    try:
        blocks.append(view(it))
    except TowtankError as error:
        blocks.append(Text(f"The surface of the craft cannot be shown: {error}", "bad"))
    blocks.append(book.draw(shape.side_view, it, caption="Hull, fins and strakes to scale, seen from starboard."))
    if it.fins:
        words = "Fins seen from astern. Arrows: sense of the force of a positive deflection."
        blocks.append(book.draw(shape.stern_view, it, caption=words))
    found = check(it)
    blocks += [_particulars(it), _hydrostatics(it)]
    blocks += [_fins(it)] if it.fins else [Text("The craft has no fins.")]
    blocks += [_strakes(it)] if it.strakes else []
    blocks += [_findings(found.findings)] if found.findings else []
    blocks += [_sources(it)] if it.sources or it.assumed else []
    return Section("craft", "Craft and conditions", tuple(blocks))


def _mark(it: Craft, *names: str) -> str:
    """Where a number comes from, by its dotted ``names`` in the craft file."""
    if any(name in it.assumed for name in names):
        return "assumed"
    said = [text for name, text in it.sources if name in names]
    if any("estimated" in text for text in said):
        return "estimated"
    parts = [entry for entry in it.assumed for name in names if entry.startswith((f"{name}.", f"{name}["))]
    if parts:
        return f"partly assumed ({len(parts)} numbers)"
    return "no source" if any(name in it.unsourced for name in names) else "given"


def _particulars(it: Craft) -> Table:
    speed, water = it.speed, it.water
    inertia = np.asarray(it.mass.inertia)
    rows = (
        ("Length overall", number(it.length), "m", _mark(it, "hull")),
        ("Largest diameter", number(it.diameter), "m", _mark(it, "hull.diameter")),
        ("Hull family", it.profile.kind, "", _mark(it, "hull.kind")),
        ("Origin aft of the nose", number(it.origin_from_nose), "m", "given"),
        ("Mass", number(it.mass.mass, 6), "kg", _mark(it, "mass.mass")),
        ("Displaced mass", number(it.mass.displaced_mass, 6), "kg",
         _mark(it, "mass.net_buoyancy_percent", "mass.volume")),
        ("CG ahead of the origin", number(it.mass.cg[0]), "m", _mark(it, "mass.cg.x")),
        ("CG to starboard", number(it.mass.cg[1]), "m", _mark(it, "mass.cg.y")),
        ("CG below the origin", number(it.mass.cg[2]), "m", _mark(it, "mass.cg.z")),
        ("Ixx, Iyy, Izz about the origin", ", ".join(number(v) for v in np.diag(inertia)), "kg m2",
         _mark(it, "mass.ixx", "mass.inertia")),
        ("Reference speed", number(speed), "m/s", _mark(it, "conditions.speed")),
        ("Water density", number(water.density, 5), "kg/m3", _mark(it, "conditions.density")),
        ("Kinematic viscosity", number(water.kinematic_viscosity), "m2/s", _mark(it, "conditions.kinematic_viscosity")),
        ("Reynolds number", number(water.reynolds(speed, it.length), 3), "", "follows"),
        ("Symmetry of fins and strakes", it.symmetry, "", "follows"),
    )  # fmt: skip
    return Table("Principal particulars and conditions", ("Quantity", "Value", "Unit", "Origin of the number"), rows,
                 stated("", GEOMETRY, more="Numbers marked assumed are choices, not data of the craft"))  # fmt: skip


def _hydrostatics(it: Craft) -> Table:
    h = check(it).hydrostatics
    rows = (
        ("Slenderness L/D", number(h.slenderness), ""), ("Prismatic coefficient", number(h.prismatic), ""),
        ("Volume of hull", number(h.hull_volume, 5), "m3"), ("Volume of fins", number(h.fin_volume), "m3"),
        ("Volume of strakes", number(h.strake_volume), "m3"),
        ("Wetted area, whole craft", number(h.wetted_area), "m2"),
        ("Centre of buoyancy aft of the nose", number(h.cb_from_nose, 5), "m"),
        ("Mass of the enclosed water", number(h.displaced_mass, 6), "kg"),
        ("Stated displacement against it", f"{h.balance_percent:+.2f}", "%"),
        ("Net buoyancy", f"{h.net_buoyancy_percent:+.2f}", "% of weight"),
        ("Trim at rest, bow up", number(float(np.degrees(h.trim)), 3), "deg"),
        ("Roll and pitch stiffness m g (zG - zB)", number(h.restoring), "N m/rad"),
    )  # fmt: skip
    return Table("Hydrostatics", ("Quantity", "Value", "Unit"), rows,
                 stated("", "integrals of the given shapes; none beyond the shapes themselves"))  # fmt: skip


def _fins(it: Craft) -> Table:
    rows = tuple(
        (
            str(i + 1), fin.name, number(float(np.degrees(fin.azimuth)), 4), number(fin.root_chord),
            number(fin.tip_chord),
            number(fin.tip_radius), number(fin.trailing_edge), f"NACA {fin.section}",
            number(float(np.degrees(fin.max_angle)), 3), number(float(np.degrees(fin.max_rate)), 3),
        )
        for i, fin in enumerate(it.fins)
    )  # fmt: skip
    head = ("No.", "Name", "Azimuth [deg]", "Root chord [m]", "Tip chord [m]", "Tip radius [m]",
            "Trailing edge aft of nose [m]",
            "Section", "Limit [deg]", "Rate limit [deg/s]")  # fmt: skip
    marked = _mark(it, "fins", "fin")
    more = "Azimuth 0 is starboard, 90 deg the keel. A positive angle is right-handed about the outward span"
    if "assumed" in marked:
        more += ". Some of these numbers are assumed; see the list of sources"
    return Table("Fins", head, rows, stated("", GEOMETRY, more=more))


def _strakes(it: Craft) -> Table:
    rows = tuple(
        (s.name, *(number(v, 4) for v in (float(np.degrees(s.azimuth)), s.start, s.end, s.height, s.end_height)),
         number(1e3 * s.thickness))
        for s in it.strakes
    )  # fmt: skip
    head = ("Name", "Azimuth [deg]", "Start aft of nose [m]", "End aft of nose [m]", "Height at start [m]",
            "Height at end [m]", "Thickness [mm]")  # fmt: skip
    marked = any(entry.startswith("strake") for entry in it.assumed)
    more = "Fixed plates; heights are measured from the hull" + (". Some numbers are assumed" if marked else "")
    return Table("Strakes", head, rows, stated("", GEOMETRY, more=more))


def _findings(findings: tuple[Finding, ...]) -> Table:
    rows = tuple((item.severity, item.where, item.message) for item in findings)
    return Table(
        "Remarks of the craft check", ("Severity", "Where", "Remark"), rows, stated("", "not applicable", axes=False)
    )


def _sources(it: Craft) -> Table:
    rows = [
        *((name, text) for name, text in it.sources),
        *((name, "ASSUMED: a choice, not data of the craft") for name in it.assumed),
    ]
    rows += [(name, "no source given") for name in it.unsourced]
    return Table("Sources of the craft's numbers", ("Number", "Source"), tuple(rows), stated("", GEOMETRY, axes=False))
