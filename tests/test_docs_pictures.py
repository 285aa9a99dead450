"""Pictures of the pages are those that the script makes, and can be read."""

import io

import numpy as np
import pytest
from PIL import Image

from scenes.canvas import encoded
from tests.docs_pictures import FOLDER, PICTURES
from tests.scenes.test_pictures import assert_inside

SHADES = 4.0
"""Mean difference, of 255, that other versions of what draws letters and packs pictures may make;
another grasp, or another view, makes more."""


def pixels(data):
    with Image.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGB")).astype(float)


def test_all_pictures_are_made_by_the_script():
    assert {path.name for path in FOLDER.iterdir()} == {f"{name}.webp" for name in PICTURES}


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_the_one_that_is_kept(name):
    figure = PICTURES[name]()
    made, kept = pixels(encoded(figure, "webp")), pixels((FOLDER / f"{name}.webp").read_bytes())
    assert_inside(figure)
    assert made.shape == kept.shape
    assert np.abs(made - kept).mean() < SHADES
    assert np.abs(made - made[::-1]).mean() > SHADES  # upside down it would be another one
