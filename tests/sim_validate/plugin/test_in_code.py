"""The marker, `assert_stable` and what it can be asked for, in tests of somebody else's."""

import re

from grasp_core.files.text_files import write_text
from grasp_core.planning.grasps_json import grasps_from_json
from tests.sim_validate.plugin.project import copied, properties_in, run_pytest

MARKED = """
import pytest
import scenes

@pytest.mark.grasp("grasps.json")
def test_of_a_file(grasp_case, assert_stable):
    assert assert_stable(grasp_case).held

@pytest.mark.grasp(object="wedge", friction=0.4, limit=1, families=("pencil",))
def test_planned(grasp_case, assert_stable):
    assert grasp_case.friction == 0.4
    assert grasp_case.grasp.family == "pencil"

@pytest.mark.grasp(object="box.obj", unit="mm")
def test_a_mesh(grasp_case):
    assert grasp_case.body.radius < 0.1

def test_unmarked(grasp_case):
    pass
"""
BOX = "\n".join(
    [f"v {x} {y} {z}" for x in (0, 30) for y in (0, 20) for z in (0, 10)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)
DEMANDS = """
import pytest

pytestmark = pytest.mark.grasp(object="wedge", limit=1)

def test_good_enough(grasp_case, assert_stable):
    assert_stable(grasp_case, min_margin=0.3, repeats=3, min_pass_rate=0.5)

def test_close_to_slipping(grasp_case, assert_stable):
    assert_stable(grasp_case, min_margin=0.49)

def test_often_dropped(grasp_case, assert_stable):
    from sim_validate.settings import Noise
    assert_stable(grasp_case, repeats=8, noise=Noise(mass=0.5), min_pass_rate=0.99)
"""


def test_marked_tests_run_with_each_grasp(blessed, tmp_path):
    copied(blessed, tmp_path)
    write_text(tmp_path / "test_marked.py", MARKED)
    write_text(tmp_path / "box.obj", BOX)
    code, said = run_pytest(tmp_path, "-v", "--strict-markers", "test_marked.py")
    assert code == 1, said
    names = [grasp.id for grasp in grasps_from_json((tmp_path / "grasps.json").read_text()).grasps]
    for name in names:
        assert f"test_of_a_file[{name}] PASSED" in said
    assert said.count("test_planned[p-") == 1
    assert said.count("test_a_mesh[") == 1
    assert "test_unmarked: grasp_case needs @pytest.mark.grasp" in said
    assert f"{2 + len(names)} passed, 1 error" in said


def answers(said, heading):
    """What pytest says about each test, by the number in its heading."""
    _, *parts = re.split(rf"_+ {heading}(\d+)\b.*_+\n", said.partition("= short test summary")[0])
    return dict(zip(map(int, parts[::2]), parts[1::2], strict=True))


WRONG_MARKERS = [
    ("", "needs the path of a grasps.json, or object="),
    ("object='wedge', taste=1", "no setting is named 'taste'"),
    ("'grasps.json', limit=1", "no setting is named 'limit'; choose from friction"),
    ("3", "takes the path of one file of grasps"),
    ("object='wedge', friction='0.5'", "friction must be a number, got '0.5'"),
    ("object='box', cones='normal', families=('pencil',)", "no grasp of box was found"),
]


def test_wrong_markers_are_named(tmp_path):
    for number, (marker, _) in enumerate(WRONG_MARKERS):
        write_text(
            tmp_path / f"test_{number}.py",
            f"import pytest\n@pytest.mark.grasp({marker})\ndef test_it(grasp_case): pass\n",
        )
    code, said = run_pytest(tmp_path)
    assert code == 2
    found = answers(said, "ERROR collecting test_")
    assert len(found) == len(WRONG_MARKERS) == 6
    for number, (_, message) in enumerate(WRONG_MARKERS):
        assert message in found[number]
    assert "Traceback" not in said
    assert "During handling" not in said


def test_more_can_be_asked_for(tmp_path):
    write_text(tmp_path / "test_demands.py", DEMANDS)
    code, said = run_pytest(tmp_path)
    assert code == 1, said
    assert "2 failed, 1 passed" in said
    assert "less than 0.49 above the predicted critical one" in said
    assert "asked for are 0.99" in said
    assert "of 8 held (" in said


BAD_DEMANDS = [
    ("assert_stable(grasp_case, min_pass_rate=0.9)", "as `repeats`"),
    ("assert_stable(grasp_case, repeats=2, min_pass_rate=80)", "from 0 up to 1, got 80"),
    ("assert_stable(grasp_case, min_margin=float('nan'))", "min_margin must be a number from 0"),
    ("assert_stable(grasp_case, trial=2)", "no setting is named 'trial'; choose from wrenches"),
    ("assert_stable(grasp_case, wrenches=[[1, 2]])", "must be a NamedWrench"),
    ("assert_stable(grasp_case.grasp)", "expected a grasp_case"),
]


def test_demands_that_are_none_are_refused(tmp_path):
    tests = ["import pytest\npytestmark = pytest.mark.grasp(object='wedge', limit=1)\n"]
    for number, (call, _) in enumerate(BAD_DEMANDS):
        tests.append(f"def test_{number}(grasp_case, assert_stable):\n    {call}\n")
    write_text(tmp_path / "test_it.py", "".join(tests))
    code, said = run_pytest(tmp_path)
    assert code == 1
    found = answers(said, "test_")
    assert len(found) == len(BAD_DEMANDS) == 6
    for number, (_, message) in enumerate(BAD_DEMANDS):
        assert message in found[number]


def test_other_frictions_and_grasps_from_anywhere(tmp_path):
    write_text(
        tmp_path / "test_it.py",
        """
import pytest
@pytest.mark.grasp(object='wedge', limit=1)
def test_it(grasp_case, assert_stable):
    body, grasp = grasp_case.body, grasp_case.grasp
    assert assert_stable(grasp_case, friction=0.3).friction == 0.3
    assert assert_stable(body, grasp, 0.4).friction == 0.4
""",
    )
    code, said = run_pytest(tmp_path)
    assert code == 0, said


def test_what_fails_before_a_test_begins_is_in_the_report_once(tmp_path):
    write_text(
        tmp_path / "test_it.py",
        """
import pytest
from sim_validate import NamedWrench

@pytest.fixture
def held(grasp_case, assert_stable):
    assert_stable(grasp_case, wrenches=[NamedWrench("push", [0, 0, 900, 0, 0, 0])])

@pytest.mark.grasp(object="wedge", limit=1)
def test_it(held):
    pass
""",
    )
    code, said = run_pytest(tmp_path, "--junitxml", "j.xml")
    assert code == 1, said
    (kept,) = properties_in(tmp_path / "j.xml")
    assert [value for name, value in kept.items() if name.endswith(".status")] == ["unstable"]
