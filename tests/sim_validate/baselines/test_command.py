"""A baseline recorded and checked from the command line; every change is reported as what it is."""

import json
import shutil

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.changing import at, changed
from tests.sim_validate.rigs import saved_plan


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    grasps = saved_plan(folder, limit=2)
    line = ["baseline", "record", str(grasps), "-o", str(folder / "base.json"), "--jobs", "1"]
    assert main([*line, "-q"]) == Exit.GOOD
    return folder


@pytest.fixture
def copy(recorded, tmp_path):
    return shutil.copytree(recorded, tmp_path / "copy")


def check(folder, *more):
    return main(["baseline", "check", str(folder / "base.json"), "--jobs", "1", *more])


@pytest.fixture
def statuses(answer, copy):
    """The status and the reasons of each grasp of the copy, checked again."""

    def checked(code):
        record = answer("baseline", "check", copy / "base.json", "--jobs", "1", code=code)
        return {one["id"]: (one["status"], " ".join(one["reasons"])) for one in record["grasps"]}

    return checked


def altered(folder, **values):
    """The baseline as if the first grasp's verdict had been another one."""
    return changed(folder / "base.json", at("grasps", 0, **values))["grasps"][0]["id"]


def test_a_regression_fails_and_says_why_and_an_improvement_only_if_asked(copy, statuses):
    name = altered(copy, limit_n=1e3)
    status, why = statuses(Exit.NEGATIVE)[name]
    assert status == "regressed"
    assert "limit_n: 1000 -> " in why
    name = altered(copy, limit_n=0.0, displacement_m=1.0)
    found = statuses(Exit.GOOD)
    assert found.pop(name)[0] == "improved"
    assert {status for status, _ in found.values()} == {"same"}
    assert check(copy, "--strict", "-q") == Exit.NEGATIVE


def test_grasps_without_entry_and_entries_without_grasp_fail(copy, statuses):
    for limit, wanted in ((1, "missing"), (3, "new")):
        saved_plan(copy, limit)
        assert wanted in {status for status, _ in statuses(Exit.NEGATIVE).values()}


def test_blessing_makes_what_was_measured_the_baseline(copy, recorded):
    altered(copy, limit_n=1e3)
    assert check(copy, "--bless", "-q") == Exit.GOOD
    assert (copy / "base.json").read_text() == (recorded / "base.json").read_text()
    assert check(copy, "-q") == Exit.GOOD


def test_other_fingertips_planned_for_are_not_comparable_until_blessed(copy, statuses):
    path = copy / "grasps.json"
    record = json.loads(path.read_text())
    record["finger"] = {"radius_m": 0.003, "approach_m": 0.05}
    for grasp in record["grasps"]:
        grasp["approach_directions"] = [each["normal"] for each in grasp["contacts"]]
    path.write_text(json.dumps(record))
    for status, why in statuses(Exit.INPUT).values():
        assert status == "not comparable"
        assert "planned for: radius_m None -> 0.003" in why
        assert "setup.fingers.fingertip_radius_m: None -> 0.003" in why
    assert check(copy, "--bless", "-q") == Exit.GOOD
    assert check(copy, "-q") == Exit.GOOD
    blessed = json.loads((copy / "base.json").read_text())
    assert blessed["settings"]["setup"]["fingers"]["fingertip_radius_m"] == 0.003


def test_the_first_grasps_of_a_file_are_a_baseline_too(tmp_path):
    grasps, base = saved_plan(tmp_path, limit=2), tmp_path / "base.json"
    line = ["baseline", "record", str(grasps), "-o", str(base), "--limit", "1", "-q"]
    assert main(line) == Exit.GOOD
    assert check(tmp_path, "-q") == Exit.GOOD
    assert len(json.loads(base.read_text())["grasps"]) == 1


def test_grasps_elsewhere_are_found_again_after_blessing(copy, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    saved_plan(other)
    asked = ("--grasps", str(other / "grasps.json"), "--bless", "-q")
    assert check(copy, *asked) == Exit.GOOD
    assert json.loads((copy / "base.json").read_text())["grasps_file"] == "../other/grasps.json"
    assert check(copy, "-q") == Exit.GOOD


def test_grasps_are_not_overwritten(copy, capsys):
    grasps = copy / "grasps.json"
    before = grasps.read_bytes()
    assert main(["baseline", "record", str(grasps), "-o", str(grasps)]) == Exit.INPUT
    assert "will not be overwritten" in capsys.readouterr().err
    assert grasps.read_bytes() == before


def test_grasps_on_another_drive_are_refused(copy, monkeypatch, capsys):
    def across_drives(*_):
        raise ValueError("path is on mount 'C:', start on mount 'D:'")

    monkeypatch.setattr("os.path.relpath", across_drives)
    line = ["baseline", "record", str(copy / "grasps.json"), "-o", str(copy / "new.json"), "-q"]
    assert main(line) == Exit.INPUT
    assert "expected grasps on the drive of" in capsys.readouterr().err
