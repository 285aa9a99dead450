"""The command `hand`: what a hand was read as."""

import math
import re
from pathlib import Path

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.three_fingers import THREE_TIPS, three_fingers_file, three_fingers_mjcf


@pytest.fixture
def words(tmp_path):
    return ["hand", three_fingers_file(tmp_path), "--fingertips", ",".join(THREE_TIPS)]


def test_every_joint_and_fingertip_of_a_file_is_shown(words, answer):
    facts = answer(*words)
    assert [finger["name"] for finger in facts["fingers"]] == list(THREE_TIPS)
    assert [finger["tip"]["radius_m"] for finger in facts["fingers"]] == pytest.approx([0.008] * 3)
    assert [len(finger["links"]) for finger in facts["fingers"]] == [2, 3, 3]
    joints = [link["joint"] for finger in facts["fingers"] for link in finger["links"]]
    names = [joint["name"] for joint in joints]
    assert names == [name for name in names if f'"{name}"' in three_fingers_mjcf()]
    spread = joints[names.index("left_spread")]
    assert spread["highest_rad"] == pytest.approx(math.radians(50.0))
    assert spread["lowest_rad"] == pytest.approx(-math.radians(50.0))
    assert {joint["torque_limit_n_m"] for joint in joints} == {0.5}
    assert len(facts["palm"]) == 1
    assert facts["ignored_pairs"] == []


def test_ranges_that_were_meant_in_radians_are_pointed_out(words, capsys):
    path = Path(words[1])
    path.write_text(re.sub(r'range="-?[0-9.]+ -?[0-9.]+"', 'range="-1.5 1.5"', path.read_text()))
    assert main(words) == Exit.GOOD
    said = " ".join(capsys.readouterr().out.split())
    assert "Every joint turns by less than 10 degrees: MJCF counts angles in degrees" in said
