import html
import json
import re

import numpy as np
import pytest

import grasp_core as gc
import scenes
from scenes.drawing.pages import UNITS
from sim_validate.main import main


@pytest.fixture(scope="module")
def plan():
    return gc.plan(scenes.example_object("wedge"), 0.5, limit=1)


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
    body, grasp = plan.body, plan[0]
    text = scenes.show(body, grasp).page
    (drawing,) = re.findall(r'id="drawing">(.*)</script>', text)
    shapes = json.loads(drawing)["shapes"]
    (contacts,) = (shape["points"] for shape in shapes if shape["role"] == "contact")
    points = body.center_of_mass + np.array(contacts) * body.radius / UNITS
    np.testing.assert_allclose(points, grasp.positions, atol=body.radius / UNITS)
