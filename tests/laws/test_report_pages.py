"""The page: whole without a network, honest about what is missing, safe with hostile names."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
import report_synthetic as case

from towtank.errors import ArtefactError, InputError
from towtank.report import build, study
from towtank.report.blocks import Table, number, with_std
from towtank.report.build import SECTIONS, report, report_study
from towtank.report.pictures import inline
from towtank.report.study import Study, completed, gather
from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.table import Comparison, Requirement, Verdict

VOID = {"meta", "img", "br", "link", "input", "hr"}


def _plane(name: str, index: float, stable: bool, probability: float) -> PlaneCriteria:
    return PlaneCriteria(
        plane=name, slopes="origin", eigenvalues=(0.02 + 0.0j, -0.1 + 0.3j), index=index, index_std=0.12,
        index_range=(index - 0.2, index + 0.2), index_wide=index + 0.05, stable=stable, probability=probability,
        doubling=34.6,
    )  # fmt: skip


VERDICT = Verdict(
    craft="hokie", level="known coefficients", speed=1.0, horizontal=_plane("horizontal", -0.31, False, 0.2),
    vertical=_plane("vertical", 0.4, True, 0.9), elevator_reversal_speed=0.41,
    effectiveness={"yaw_test": (0.01, "1/s")},
    requirements=(Requirement("horizontal plane stable", 0.02, "1/s", 0.0, False, "probability 20 %"),),
    comparison=(Comparison("overshoot", 12.5, 3.25, "deg", "zigzag against heading step"),),
    words="Unstable in the horizontal plane with fins held.\n\nStable in the vertical plane.",
)  # fmt: skip


class Page(HTMLParser):
    """Tags in order, attributes that load something, section keys, text outside scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.stack, self.loads, self.sections, self.words, self.ids, self.tables = [], [], [], [], [], 0
        self.notes = 0
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if tag not in VOID:
            self.stack.append(tag)
        self.loads += [value for key, value in attrs.items() if key in ("src", "href", "xlink:href", "data", "action")]
        self.sections += [attrs["id"]] if tag == "section" else []
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.tables += tag == "table"
        self.notes += attrs.get("class") == "note"

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.stack, f"</{tag}> closes nothing"
        assert self.stack.pop() == tag

    def handle_data(self, data):
        if not self.stack or self.stack[-1] not in ("script", "style"):
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def whole() -> str:
    everything = Study(
        craft=replace(case.craft(), title="Hokie of this test"), plan=case.plan(), runs=case.runs(),
        derivatives=case.derivatives(), frequency=case.frequency(), trajectories=case.trials(), verdict=VERDICT,
        index={"trials": [{"name": "turning-15deg", "indices": {"advance": {"value": 19.1, "std": 1.3, "unit": "m"}}}]},
        validation={"rows": [
            {"quantity": "Y'v of a tested hull", "predicted": -0.0062, "measured": -0.0059, "error_percent": 5.1,
             "role": "predicted", "source": "roddy1990"}]},
    )  # fmt: skip
    return build.page(completed(everything))


@pytest.fixture(scope="module")
def parsed(whole) -> Page:
    return Page(whole)


def test_every_tag_is_closed_and_every_section_is_there_in_order(parsed):
    assert parsed.stack == []
    assert parsed.sections == [
        "summary", "craft", "tests", "grid", "forces", "model", "fit", "trials", "mc", "faults", "compare", "verdict",
        "design", "validation", "sensitivity", "limits", "constants", "provenance", "runs",
    ]  # fmt: skip
    assert len(parsed.sections) == len(SECTIONS)


def test_nothing_is_loaded_from_anywhere(whole, parsed):
    assert all(load.startswith(("#", "data:")) for load in parsed.loads)
    without_scripts = re.sub(r"<script.*?</script>", "", whole, flags=re.DOTALL)
    found = set(re.findall(r"(?:https?:)?//[\w.-]+\.\w+[^\s\"'<)]*", without_scripts))
    assert all("w3.org" in address for address in found)  # XML namespaces are names, not addresses
    assert "@import" not in whole
    assert "url(http" not in whole


def test_ids_are_unique_and_links_lead_somewhere(whole, parsed):
    assert len(parsed.ids) == len(set(parsed.ids))
    assert {load[1:] for load in parsed.loads if load.startswith("#")} <= set(parsed.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", whole)) <= set(parsed.ids)


def test_page_is_small_enough_to_send(whole):
    assert len(whole.encode()) < 6e6


def test_every_table_has_its_statement(parsed):
    assert parsed.tables == parsed.notes > 12
    assert parsed.text.count("Uncertainty: ") >= parsed.tables


def test_verdict_comes_first_and_level_is_in_the_head(parsed):
    text = parsed.text
    assert text.index("Unstable in the horizontal plane") < text.index("Principal particulars")
    assert text.index("known coefficient set, not a measurement") < text.index("Contents")


def test_numbers_of_each_stage_reach_the_page(parsed):
    text = parsed.text
    for words in (
        "8.150",
        "drift-16",
        "too violent for the test",
        "tactical diameter",
        "-0.31",
        "19.1 1.3",
        "+5.1",
        "lambda = 0.5",
    ):
        assert words in text, words
    yuv = with_std(case.derivatives()["Yuv"], np.hypot(0.02, 0.15) * abs(case.derivatives()["Yuv"]))
    assert f"{yuv[0]} {yuv[1]}" in text
    assert number(1000.0 * case.PRIMES["Yuv"], 2).rstrip("0") in text


def test_assumed_numbers_are_marked(parsed):
    assert "Water density 997.56 kg/m3 assumed" in parsed.text
    assert "estimated" in parsed.text  # the inertia of a uniform body


def test_craft_can_be_seen_without_scripts(whole):
    glb = base64.b64decode(re.search(r'id="craft-glb">([^<]+)<', whole)[1])
    assert glb[:4] == b"glTF"
    assert int.from_bytes(glb[8:12], "little") == len(glb)
    still = base64.b64decode(re.search(r'data:image/png;base64,([^"]+)"', whole)[1])
    assert still.startswith(b"\x89PNG")
    assert "TowtankThree" in whole


def test_hostile_names_stay_text():
    bad = "<script>alert('x')</script><img src=http://evil.example/x onerror=alert(1)> $\\frac{"
    hostile = replace(case.craft(), title=bad, sources=(("hull", bad),))
    trial = replace(case.trials()[1], name=bad, status=bad)
    given = Study(craft=hostile, trajectories=(trial,), derivatives=None, validation={"rows": []})
    text = build.page(given)
    page = Page(text)
    assert "<script>alert" not in text
    assert "<img src=http" not in text
    assert bad[:20] in page.text
    assert all(load.startswith(("#", "data:")) for load in page.loads)


@pytest.mark.parametrize(
    ("things", "missing"),
    [
        ((), ("No craft was given", "No captive test", "no derivatives", "No trial", "no verdict")),
        ((case.derivatives(),), ("No craft was given", "No run was given", "No pole map")),
        ((case.trials()[2],), ("No craft was given", "no derivatives")),
        ((case.runs()[0],), ("no derivatives", "the library's craft of the same name")),
    ],
    ids=["nothing", "derivatives", "one trial", "one run"],
)
def test_a_missing_stage_is_named_with_its_remedy(tmp_path, things, missing):
    page = Page(report(tmp_path / "page.html", *things).read_text("utf-8"))
    assert page.stack == []
    assert len(page.sections) == len(SECTIONS)
    for words in missing:
        assert words in page.text, words
    assert "towtank" in page.text


def test_order_and_nesting_of_things_do_not_matter():
    one = gather([[case.runs()], case.derivatives(), case.craft(), case.trials()])
    two = gather([case.trials()[0], case.craft(), *case.trials()[1:], case.derivatives(), case.runs()])
    assert one.runs == two.runs
    assert one.trajectories == two.trajectories
    assert one.model is not None
    assert (one.craft, one.derivatives) == (two.craft, two.derivatives)


def test_a_model_brings_its_craft_and_derivatives():
    from towtank.model.equations import Model

    found = gather([Model(case.craft(), case.derivatives())])
    assert (found.craft, found.derivatives) == (case.craft(), case.derivatives())


def test_another_craft_of_a_known_name_is_not_shown_as_the_librarys():
    assert gather([replace(case.runs()[0], length=9.0)]).craft is None


def test_what_cannot_be_shown_is_refused_by_name():
    with pytest.raises(InputError, match="SimpleNamespace cannot be shown"):
        gather([SimpleNamespace()])
    with pytest.raises(InputError, match="two things are a craft"):
        gather([case.craft(), replace(case.craft(), name="other")])


def test_study_folder_with_broken_files_still_gives_a_page(tmp_path):
    from towtank.derive.files import write_derivatives
    from towtank.tank.files import run_path, write_run

    for run in case.runs()[:2]:
        write_run(run, run_path(tmp_path, run.id))
    broken = tmp_path / "runs" / "broken-00000000" / "run.nc"
    broken.parent.mkdir(parents=True)
    broken.write_bytes(b"not netCDF")
    write_derivatives(case.derivatives(), tmp_path / "derivatives.json")
    (tmp_path / "verdict.json").write_text(json.dumps({"schema": "towtank/other/1"}))
    page = Page(report_study(tmp_path).read_text("utf-8"))
    assert "verdict.json has schema" in page.text
    assert "broken-00000000" in page.text
    assert "drift--16" in page.text
    assert "There is no verdict" in page.text


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ArtefactError, match="not a folder"):
        report_study(tmp_path / "none")


def test_of_two_runs_with_one_name_the_later_file_counts(tmp_path):
    import os

    from towtank.tank.files import run_path, write_run

    old = case.runs()[0]
    new = replace(old, id="drift--16-ffffffff", loads=2.0 * old.loads)
    os.utime(write_run(old, run_path(tmp_path, old.id)), (1e9, 1e9))
    write_run(new, run_path(tmp_path, new.id))
    assert [run.id for run in study.read_study(tmp_path).runs] == ["drift--16-ffffffff"]


def test_values_keep_two_digits_of_their_uncertainty():
    assert with_std(-1840.33, 94.6) == ("-1840", "95")
    assert with_std(0.0012345, 0.00016) == ("0.00123", "0.00016")
    assert with_std(12.0, None) == ("12.00", "-")
    assert with_std(float("nan"), 1.0) == ("-", "-")
    assert number(float("nan")) == "-"


def test_numeric_columns_are_found_by_content():
    table = Table("t", ("a", "b", "c"), (("x", "1.2", "-"), ("y", "-3e-05", "")), "note")
    assert table.numeric == (False, True, False)


def test_svg_ids_get_the_prefix_everywhere_they_are_used():
    text = '<?xml?><svg><g id="a"/><use href="#a" xlink:href="#a" clip-path="url(#a)"/><path d="M 1.23456 2"/></svg>'
    out = inline(text, "f9-")
    assert (
        out
        == '<svg><g id="f9-a"/><use href="#f9-a" xlink:href="#f9-a" clip-path="url(#f9-a)"/><path d="M 1.23 2"/></svg>'
    )
