"""Pictures of the pages are those that the script makes, and can be read."""

import io

import matplotlib
import numpy as np
import pytest
from PIL import Image

import grasp_core as gc
import scenes
from scenes.drawing.canvas import STYLE, encoded
from scenes.drawing.pictures import grasp_figure
from sim_validate.reports.charts.margin_charts import margin_figure
from sim_validate.reports.charts.wrench_charts import wrench_figure
from tests.docs_pictures import FOLDER, FRICTION, PICTURES, best
from tests.scenes.drawing.test_pictures import assert_inside

BLOCK = 16
"""Pixels on a side of the squares that are compared: a line of text is as high."""
ANOTHER = 30.0
"""Largest difference of a square's mean colour, of 255: letters of another font, or drawn in
another way, make up to 14, what is drawn for another grasp or of other figures 60 or more."""


def pixels(data):
    with Image.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGB")).astype(float)


def kept(name):
    return pixels((FOLDER / f"{name}.webp").read_bytes())


def apart(figure, picture):
    """Largest difference of any square of a figure from that of a picture."""
    difference = pixels(encoded(figure, "webp")) - picture
    rows, columns = (size // BLOCK for size in difference.shape[:2])
    whole = difference[: rows * BLOCK, : columns * BLOCK]
    squares = whole.reshape(rows, BLOCK, columns, BLOCK, 3).mean(axis=(1, 3))
    return np.abs(squares).max()


def test_all_pictures_are_made_by_the_script():
    assert {path.name for path in FOLDER.iterdir()} == {f"{name}.webp" for name in PICTURES}


SLOW = {"fidelity", "survival"}
"""Pictures that take seconds, as they need simulation."""


def marked(name, *more):
    return pytest.param(name, *more, marks=[pytest.mark.slow] if name in SLOW else [], id=name)


@pytest.mark.parametrize("name", [marked(name) for name in PICTURES])
def test_a_picture_is_the_one_that_is_kept(name):
    figure = PICTURES[name]()
    assert apart(figure, kept(name)) < ANOTHER
    assert_inside(figure)


def another_grasp():
    body = scenes.example_object("wedge")
    return body, gc.plan(body, FRICTION, families=("pencil",), limit=2).grasps[1]


def with_other_figures():
    figure = PICTURES["fidelity"]()
    figure.axes[0].plot([150.0, 200.0], [250.0, 250.0], "o", color="#0072B2", ms=12)  # pixels
    return figure


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


@pytest.mark.parametrize("name", ["grasp", "wrenches", "margins"])
@pytest.mark.parametrize(
    "other",
    [
        {"font.family": "DejaVu Serif"},
        {"text.hinting": "none"},
        {"text.hinting": "force_autohint"},
        {"text.antialiased": False},
        {"path.snap": False},
    ],
    ids=str,
)
def test_letters_and_lines_that_are_drawn_otherwise_do_not_count(name, other, monkeypatch):
    """As by another release of the library that draws, with half the room to spare."""
    for setting, value in other.items():
        monkeypatch.setitem(STYLE, setting, value)
    figure = PICTURES[name]()
    with matplotlib.rc_context(other):
        assert 0.0 < apart(figure, kept(name)) < 0.5 * ANOTHER
