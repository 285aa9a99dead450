"""Pictures of the pages are those that the script makes, and can be read."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import grasp_core as gc
import scenes
from scenes.drawing.pictures import grasp_figure
from scenes.drawing.sheets import Dots, png_of
from sim_validate.reports.charts.margin_charts import margin_figure
from sim_validate.reports.charts.wrench_charts import wrench_figure
from tests.docs_pictures import FOLDER, FRICTION, PICTURES, best
from tests.scenes.drawing.whole import assert_whole

BLOCK = 16
"""Pixels on a side of the squares that are compared: a line of text is as high."""
ANOTHER = 30.0
"""Largest difference of a square's mean colour, of 255: letters that another release of the library
draws in another way make up to 14, other figures make 60 or more."""


def pixels(data):
    with Image.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGB")).astype(float)


def kept(name):
    return pixels((FOLDER / f"{name}.webp").read_bytes())


def apart(figure, picture):
    """Largest difference of any square of a figure from that of a picture."""
    difference = pixels(png_of(figure)) - picture
    rows, columns = (size // BLOCK for size in difference.shape[:2])
    whole = difference[: rows * BLOCK, : columns * BLOCK]
    squares = whole.reshape(rows, BLOCK, columns, BLOCK, 3).mean(axis=(1, 3))
    return np.abs(squares).max()


def test_all_pictures_are_made_by_the_script():
    assert {path.name for path in FOLDER.iterdir()} == {f"{name}.webp" for name in PICTURES}


SLOW = {"fidelity"}
"""Pictures that take seconds, as they need simulation."""


def marked(name, *more):
    return pytest.param(name, *more, marks=[pytest.mark.slow] if name in SLOW else [], id=name)


@pytest.mark.parametrize("name", [marked(name) for name in PICTURES])
def test_a_picture_is_the_one_that_is_kept(name):
    figure = PICTURES[name]()
    assert apart(figure, kept(name)) < ANOTHER
    assert_whole(figure)


def another_grasp():
    body = scenes.example_object("wedge")
    return body, gc.plan(body, FRICTION, families=("pencil",), limit=2).grasps[1]


def with_other_figures():
    figure = PICTURES["fidelity"]()
    more = Dots(np.array([[150.0, 250.0], [200.0, 250.0]]), "#0072B2", 8.0)
    return replace(figure, marks=(*figure.marks, more))


@pytest.mark.parametrize(
    ("name", "make"),
    [
        marked("grasp", lambda: grasp_figure(*another_grasp(), FRICTION)),
        marked("wrenches", lambda: wrench_figure(*another_grasp(), FRICTION)),
        marked(
            "margins", lambda: margin_figure(*best("wedge", "pencil", FRICTION), 0.8 * FRICTION)
        ),
        marked("fidelity", with_other_figures),
    ],
)
def test_another_picture_would_be_noticed(name, make):
    assert apart(make(), kept(name)) > ANOTHER
