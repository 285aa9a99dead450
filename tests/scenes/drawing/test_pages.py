"""Pages and cards show a grasp, its figures and nothing that a name could run."""

import html
import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.drawing import pages
from sim_validate.main import main
from tests.scenes.drawing.whole import assert_contacts

SVG = "{http://www.w3.org/2000/svg}"
EVIL = "<script>alert('&')</script>"


@pytest.fixture(scope="module")
def plan():
    return gc.plan(scenes.example_object("wedge"), 0.5, limit=7)


def read(value):
    """The element of a value's HTML, which is XML too, and the texts of its cells."""
    found = ElementTree.fromstring(value._repr_html_())  # noqa: S314 - our own text
    return found, ["".join(cell.itertext()) for cell in found.iter("td")]


def test_an_object_shows_its_edges_and_its_size(plan):
    found, cells = read(plan.body)
    assert cells == ["faces", "8", "triangles", "8", "radius", "67.74 mm", "volume", "199.1 cm³"]
    assert found.find(f".//{SVG}path") is not None
    assert found.find(f".//{SVG}text") is None


def test_a_plan_shows_four_fingers_and_no_figure_that_was_put_off(plan, monkeypatch):
    monkeypatch.setattr(gc.Grasp, "__getattr__", lambda *_: pytest.fail("a figure was computed"))
    found, cells = read(plan)
    assert [text.text for text in found.iter(f"{SVG}text")] == ["0", "1", "2", "3"]
    assert cells[4:6] == ["c-0-1-2-7", "concurrent"]
    assert cells[-1] == "..."
    assert len(cells) == 4 * 6 + 1


def test_a_plan_without_grasps_says_why():
    plan = gc.plan(
        scenes.example_object("box"),
        0.5,
        families=("concurrent",),
        settings=gc.PlanSettings(cones="normal"),
    )
    assert read(plan)[1] == [plan.absence]


@pytest.mark.slow
def test_a_verdict_shows_its_trials_and_a_scene_its_object(plan):
    verdict = sv.validate(plan.body, plan[0], 0.5)
    found, cells = read(verdict)
    assert found.find(".//b").text == "c-0-1-2-7: held"
    assert cells.count("held") == 8
    assert cells[-2:] == ["0 of 13 trials failed", "3 of 3 negative controls let go"]
    assert read(verdict.scene)[1] == ["friction", "0.5"]


def test_names_of_objects_run_nothing(plan):
    body = replace(plan.body, name=EVIL)
    for value in (body, replace(plan, body=body)):
        found, _ = read(value)
        assert found.find(".//script") is None
        assert EVIL in found.find(".//b").text


def test_what_cannot_be_drawn_is_shown_as_text_and_never_raises(plan, monkeypatch):
    elsewhere = replace(plan, body=scenes.example_object("dodecahedron"))
    assert elsewhere._repr_html_() is None
    assert repr(elsewhere).startswith("Plan(")
    monkeypatch.setattr(pages, "MOST_DRAWN_CORNERS", 10)
    found, cells = read(plan.body)
    assert found.find(f".//{SVG}path") is None
    assert "67.74 mm" in cells


def test_a_notebook_and_the_command_view_show_the_same_page(plan, tmp_path):
    shown = scenes.show(plan.body, plan[0], 0.5)
    gc.save_grasps(tmp_path / "grasps.json", plan)
    page = tmp_path / "page.html"
    assert main(["view", str(tmp_path / "grasps.json"), "--page", str(page)]) == 0
    assert page.read_text() == shown.page
    assert shown.write(tmp_path / "new" / "own.html").read_text() == shown.page
    (framed,) = re.findall(
        r'<iframe sandbox="allow-scripts" .* srcdoc="([^"]*)">', shown._repr_html_()
    )
    assert html.unescape(framed) == shown.page


def test_the_page_holds_the_contacts(plan):
    text = scenes.show(plan.body, plan[0]).page
    (drawing,) = re.findall(r'id="drawing">(.*)</script>', text)
    assert_contacts(json.loads(drawing)["shapes"], plan.body, plan[0].positions)
