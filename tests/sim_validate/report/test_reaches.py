"""Reports show the hand in the grasps that it reaches, and say why it is missing elsewhere."""

import json
import shlex

import pytest

from grasp_core.errors import InputError
from scenes.drawing.sheets import FINGER_COLOURS, HAND
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report.report import write_report
from tests.scenes.drawing.standing import (
    ASKED,
    FRICTION,
    GRASP,
    POSITIONS,
    run_with_hand,
    small_plan,
    standing,
)
from tests.scenes.drawing.whole import assert_contacts
from tests.sim_validate.changing import at, changed
from tests.sim_validate.report.test_report import Page

(OTHER,) = (each.id for each in small_plan() if each.id != GRASP)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return run_with_hand(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def report(run, tmp_path_factory):
    return write_report(run, tmp_path_factory.mktemp("report"), jobs=1).index.parent


def test_cards_show_the_hand_where_it_stands(report):
    index = Page((report / "index.html").read_text())
    pictures = [known["src"] for tag, known in index.tags if tag == "img"]
    assert pictures == [
        f"pictures/{name}-hand.svg" if name == GRASP else f"pictures/{name}.svg"
        for name in (each.id for each in small_plan())
    ]
    said = " ".join(index.said)
    assert "The hand allegro reaches 1 of 2 grasps." in said
    assert "allegro: reached, within regions" in said
    assert "allegro: not reached, links or the table are in the way" in said
    text = (report / "pictures" / f"{GRASP}-hand.svg").read_text()
    assert "with the hand allegro" in text
    for finger in FINGER_COLOURS:
        assert finger.lower() in text.lower()


def test_the_page_turns_the_hand_and_has_its_figures(report):
    page = Page((report / "grasps" / f"{GRASP}.html").read_text())
    drawing = json.loads(page.data["drawing"])
    shapes = drawing["shapes"]
    roles = [shape["role"] for shape in shapes]
    assert roles.count("fingertip") == 4
    assert roles.count("hand") > 20
    assert {shape["colour"] for shape in shapes if shape["role"] == "hand"} == {HAND}
    assert all(shape["solid"] for shape in shapes if shape["role"] in {"hand", "fingertip"})
    assert_contacts(shapes, standing()[0], POSITIONS)
    assert {"finger", "force cone"} <= set(drawing["hidden"])
    assert not {"hand", "fingertip", "contact"} & set(drawing["hidden"])
    said = " ".join(" ".join(page.said).split())
    for part in ("In the hand allegro", "reached, within regions", "Within regions",
                 "0: thumb, 1: ring, 2: first, 3: middle"):  # fmt: skip
        assert part in said


def test_a_grasp_that_is_not_reached_says_why(report):
    page = Page((report / "grasps" / f"{OTHER}.html").read_text())
    assert "hand" not in {shape["role"] for shape in json.loads(page.data["drawing"])["shapes"]}
    said = " ".join(page.said)
    assert "not reached, links or the table are in the way" in said
    assert "From 3 starts no pose was found: fingertips did not get to their contacts." in said
    assert not (report / "pictures" / f"{OTHER}-hand.svg").exists()


def test_the_command_of_the_page_seeks_the_pose_again(report, asked):
    page = (report / "grasps" / f"{GRASP}.html").read_text()
    line = next(line for line in page.splitlines() if "graspproof reach" in line)
    words = shlex.split(line.partition("graspproof ")[2])
    assert words[:4] == ["reach", "grasps.json", "--hand", "allegro"]
    assert main(words) == Exit.GOOD
    (command,) = asked
    assert (command.grasp, command.friction, command.pose) == (GRASP, FRICTION, ASKED)


def doubled(record):
    record["reaches"] *= 2
    record["summary"] = {name: 2 * count for name, count in record["summary"].items()}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (doubled, "two records of one grasp"),
        (at("reaches", 0, contacts_sha256="0" * 64), "contacts of .* differ"),
        (at("reaches", 0, reached=False), "reached: false contradicts"),
        (at("reaches", 0, joints_rad=None), "exactly where the reason is"),
        (
            at("hand", "fingers", 0, "tip", center_m=[0.0, 0.0, 0.01]),
            "a fingertip is .* mm off its contact, so it is about another hand than allegro",
        ),
        (
            at("hand", name="other"),
            "the pose is one of allegro, so it is about another hand than other",
        ),
        (at("object", content_sha256="0" * 64), "another object"),
    ],
)
def test_a_file_that_contradicts_itself_or_its_grasps_is_refused(change, said, tmp_path):
    folder = run_with_hand(tmp_path)
    changed(folder / "reaches.json", change)
    with pytest.raises(InputError, match=rf"reaches\.json: .*{said}"):
        write_report(folder, jobs=1)


def test_the_command_view_shows_the_hand_unless_it_is_left_out(run, tmp_path, capsys):
    asked = ["view", str(run), "--grasp", GRASP, "--page"]
    for name, more, shown in (("a", [], True), ("b", ["--no-hand"], False)):
        path = tmp_path / f"{name}.html"
        assert main([*asked, str(path), *more]) == Exit.GOOD
        assert ('"role":"hand"' in path.read_text()) == shown
        assert ("Fingers of allegro" in path.read_text()) == shown
    assert main(["view", str(run), "--grasp", OTHER, "--page", str(tmp_path / "c.html")]) == 0
    assert "the hand is not shown" in capsys.readouterr().err
