"""The ledger of a study: done means same inputs and untouched files; an edited result is never lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from towtank.cli.study import Study, program_hash


@pytest.fixture
def study(tmp_path: Path) -> Study:
    made = Study(tmp_path / "study")
    made.root.mkdir()
    made.derivatives.write_text("value 1")
    made.record("derive", {"runs": "abc"}, [made.derivatives], 1.5, {"runs": 4})
    return made


def test_a_stage_is_done_while_inputs_and_files_are_the_same(study: Study):
    assert study.current("derive", {"runs": "abc"})


def test_other_inputs_an_edit_or_a_missing_file_undo_a_stage(study: Study):
    assert not study.current("derive", {"runs": "other"})
    assert not study.current("derive", {"runs": "abc", "more": "x"})
    assert not study.current("trials", {})
    study.derivatives.write_text("value 2")
    assert not study.current("derive", {"runs": "abc"})
    study.derivatives.unlink()
    assert not study.current("derive", {"runs": "abc"})


def test_an_edited_result_is_kept_beside_the_new_one(study: Study):
    assert study.put_aside(study.derivatives) is None
    study.derivatives.write_text("by hand")
    first = study.put_aside(study.derivatives)
    study.derivatives.write_text("by hand again")
    second = study.put_aside(study.derivatives)
    assert first is not None
    assert second is not None
    assert (first.read_text(), second.read_text()) == ("by hand", "by hand again")


def test_an_empty_file_is_not_worth_keeping(study: Study):
    study.derivatives.write_text("")
    assert study.put_aside(study.derivatives) is None


def test_a_result_made_elsewhere_counts_as_edited(study: Study):
    study.verdict.write_text("from somewhere")
    assert study.edited(study.verdict)


def test_stages_do_not_disturb_each_other(study: Study):
    study.model.write_text("m")
    study.record("model", {}, [study.model], 0.1)
    assert study.current("derive", {"runs": "abc"})
    assert study.stages()["derive"]["summary"] == {"runs": 4}


def test_a_study_can_be_moved(study: Study, tmp_path: Path):
    moved = study.root.rename(tmp_path / "elsewhere")
    assert Study(moved).current("derive", {"runs": "abc"})


def test_the_program_is_identified_by_version_and_source():
    version, _, source = program_hash().partition("+")
    assert version.count(".") == 2
    assert len(source) == 8
