"""The command `hand`: what a hand was read as."""

import json
import math

import pytest

from sim_validate.cli.exit_codes import Exit
from sim_validate.main import main
from tests.three_fingers import THREE_TIPS, three_fingers_file, three_fingers_mjcf


@pytest.fixture
def words(tmp_path):
    return ["hand", three_fingers_file(tmp_path), "--fingertips", ",".join(THREE_TIPS)]


def test_every_joint_and_fingertip_of_a_file_is_shown(words, capsys):
    assert main([*words, "--json"]) == Exit.GOOD
    facts = json.loads(capsys.readouterr().out)
    assert [finger["fingertip"] for finger in facts["fingers"]] == list(THREE_TIPS)
    assert [finger["tip_radius_m"] for finger in facts["fingers"]] == pytest.approx([0.008] * 3)
    assert [len(finger["joints"]) for finger in facts["fingers"]] == [2, 3, 3]
    joints = [joint for finger in facts["fingers"] for joint in finger["joints"]]
    names = [joint["name"] for joint in joints]
    assert names == [name for name in names if f'"{name}"' in three_fingers_mjcf()]
    spread = joints[names.index("left_spread")]
    assert spread["highest_rad"] == pytest.approx(math.radians(50.0))
    assert spread["lowest_rad"] == pytest.approx(-math.radians(50.0))
    assert {joint["torque_limit_n_m"] for joint in joints} == {0.5}
    assert facts["palm_shapes"] == 1
    assert facts["may_overlap"] == []


def test_the_tables_say_the_same_as_the_file(words, capsys):
    assert main(words) == Exit.GOOD
    said = capsys.readouterr().out
    for text in ("fingers of three_fingers", "left_spread", "-50.0 to 50.0", "palm has 1 shape"):
        assert text in said
    assert "may overlap" not in said


def test_a_hand_without_torque_limits_says_that_none_are_stated(capsys):
    assert main(["hand", "allegro"]) == Exit.GOOD
    said = capsys.readouterr().out
    assert said.count("none stated") == 16
    assert "Links that may overlap, besides neighbours: palm and thumb_proximal." in said


def test_fingers_that_meet_in_the_middle_of_their_ranges_are_not_listed(tmp_path, capsys):
    """With the ends bent by 45 degrees more, they meet in the middle of the ranges."""
    path = tmp_path / "closed.xml"
    path.write_text(three_fingers_mjcf().replace('range="-90 10"', 'range="-170 0"'))
    assert main(["hand", str(path), "--fingertips", ",".join(THREE_TIPS), "--json"]) == Exit.GOOD
    pairs = json.loads(capsys.readouterr().out)["may_overlap"]
    assert pairs == []


def test_a_file_without_named_fingertips_is_refused(words, capsys):
    assert main(words[:2]) == Exit.INPUT
    assert "name 3 to 5 fingertips" in capsys.readouterr().err
