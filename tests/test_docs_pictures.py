"""Pictures of the pages are those that the script makes, and can be read."""

import io

import numpy as np
import pytest
from PIL import Image

from scenes.drawing.sheets import png_of
from tests.docs_pictures import FOLDER, PICTURES
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


LONGEST = {"fidelity", "placement", "trials"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in LONGEST)) for name in PICTURES],
)
def test_a_picture_is_the_one_that_is_kept(name):
    figure = PICTURES[name]()
    assert apart(figure, kept(name)) < ANOTHER
    assert_whole(figure)
