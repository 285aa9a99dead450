"""Records are divided into units, which are named by all that decides what comes out."""

import shutil

import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.judge import sets
from sim_validate.judge.formats.reading import read_records
from sim_validate.judge.judging import Stage
from sim_validate.judge.sets import RecordSet
from tests.sim_validate.judge.four_fingers import CLOSED, TWO_OPEN, judging, write_grasps

QUICK = sv.JudgeSettings(tests=(), trial=False)


@pytest.fixture
def folder(tmp_path):
    judging(tmp_path / "in", CLOSED)
    return tmp_path / "in"


def units(folder, settings=QUICK, objects=None):
    records = read_records([folder / "grasps.json"])
    return RecordSet.of(records, folder / "four.xml", objects or folder, settings).units


def judged(folder, **asked):
    grasps, hand = folder / "grasps.json", folder / "four.xml"
    return sv.judge_records([grasps], hand, folder, QUICK, **asked)


def test_records_are_judged_in_python(folder):
    write_grasps(folder / "grasps.json", CLOSED, TWO_OPEN)
    found = judged(folder, format="table")
    assert [each.closed for each in found.records] == [True, False]
    assert found.records[0].critical_friction == pytest.approx(0.0, abs=1e-6)
    assert found.records[0].tests == ()
    assert found.records[0].passed is found.records[0].held is None
    assert found.records[1].joints.tolist() == list(TWO_OPEN)
    assert sv.Judgements.of_text(found.text()).text() == found.text()


def test_units_have_records_of_one_object_at_one_scale(folder, monkeypatch):
    monkeypatch.setattr(sets, "UNIT_RECORDS", 2)
    shutil.copy(folder / "cube.obj", folder / "a.obj")
    names = ["cube", "a", "cube", "cube", "a"]
    write_grasps(folder / "grasps.json", *[CLOSED] * 5, objects=names)
    found = [[each.id for each in unit.records] for unit in units(folder)]
    assert found == [[f"grasps.json#{k}" for k in own] for own in ((1, 4), (0, 2), (3,))]


def test_the_name_of_a_unit_is_the_same_elsewhere_and_another_with_other_contents(folder, tmp_path):
    (first,) = units(folder)
    (again,) = units(shutil.copytree(folder, tmp_path / "elsewhere"))
    assert again.id == first.id
    names = {first.id}
    for change in (
        lambda: write_grasps(folder / "grasps.json", TWO_OPEN),
        lambda: (folder / "cube.obj").write_text((folder / "cube.obj").read_text() + "\n"),
        lambda: (folder / "four.xml").write_text(
            (folder / "four.xml").read_text().replace("0.006", "0.007")
        ),
    ):
        change()
        (unit,) = units(folder)
        names.add(unit.id)
    (unit,) = units(folder, sv.JudgeSettings(tests=("dexonomy",), trial=False))
    assert len({*names, unit.id}) == 5


def test_a_hand_or_an_object_that_changes_meanwhile_ends_the_work(folder):
    (unit,) = units(folder)
    (folder / "cube.obj").write_text((folder / "cube.obj").read_text() + "\n")
    with pytest.raises(sets.WorkerError, match="cube: this file has changed"):
        sets.judged_unit(unit)
    (unit,) = units(folder)
    (folder / "four.xml").write_text((folder / "four.xml").read_text() + "\n\n")
    sets._known_hand.cache_clear()
    assert sets.judged_unit(unit).complete  # white space does not count
    text = (folder / "four.xml").read_text()
    (folder / "four.xml").write_text(text.replace("-30 30", "-29 30"))
    sets._known_hand.cache_clear()
    with pytest.raises(sets.WorkerError, match=r"four\.xml: this file has changed"):
        sets.judged_unit(unit)


def test_a_record_that_fails_among_others_fails_alone(folder, monkeypatch):
    write_grasps(folder / "grasps.json", CLOSED, TWO_OPEN, CLOSED)
    judge = Stage.judged

    def failing(stage, records):
        if any(each.id.endswith("#1") for each in records):
            raise gc.SolverError("no answer")
        return judge(stage, records)

    monkeypatch.setattr(Stage, "judged", failing)
    found = judged(folder)
    assert [each.id for each in found.records] == ["grasps.json#0", "grasps.json#2"]
    assert dict(found.unjudged) == {"grasps.json#1": "no answer"}
    assert not found.complete


def test_an_object_that_cannot_be_read_loses_its_records(folder):
    shutil.copy(folder / "cube.obj", folder / "torn.obj")
    write_grasps(folder / "grasps.json", CLOSED, CLOSED, objects=["torn", "cube"])
    (folder / "torn.obj").write_text("v 0 0 0\n")
    found = judged(folder)
    assert [each.object for each in found.records] == ["cube"]
    assert "torn.obj" in found.unjudged["grasps.json#0"]


def test_records_of_a_hand_need_it(folder):
    with pytest.raises(gc.InputError, match=r"grasps\.json: the record is of a hand"):
        sv.judge_records([folder / "grasps.json"], None, folder)
    with pytest.raises(gc.InputError, match="tests must be different, got dexonomy, dexonomy"):
        sv.JudgeSettings(tests=("dexonomy", "dexonomy"))


def test_the_least_that_four_fingers_resist_is_a_turn_about_a_line_of_two(folder):
    """The other two of them resist it by friction alone, 2 mu p a; the radius is a sqrt(3)."""
    (found,) = judged(folder).records
    assert found.weakest_n == pytest.approx(2.0 * QUICK.friction * QUICK.push_n / 3**0.5, rel=1e-4)
