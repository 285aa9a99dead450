"""What drawings must be: texts are on a sheet, none on another; and what clips show."""

import itertools

import numpy as np
from PIL import Image

from scenes.drawing.pages import PER_RADIUS
from scenes.drawing.panels import width_of


def box(words):
    """Left, top, right and bottom of a text, at most."""
    long, high = width_of(words.text, words.size), 0.5 * words.size
    if words.upwards:
        return words.x - high, words.y - 0.5 * long, words.x + high, words.y + 0.5 * long
    left = words.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[words.anchor] * long
    return left, words.y - high, left + long, words.y + high


def overlap(one, two):
    return min(one[2], two[2]) > max(one[0], two[0]) and min(one[3], two[3]) > max(one[1], two[1])


def assert_whole(sheet):
    """That every text is on the sheet, and none on another."""
    texts = list(sheet.words())
    assert texts
    for words in texts:
        left, top, right, bottom = box(words)
        assert min(left, top) >= 0.0, words
        assert right <= sheet.width, words
        assert bottom <= sheet.height, words
    for one, two in itertools.combinations(texts, 2):
        assert not overlap(box(one), box(two)), (one.text, two.text)


def assert_contacts(shapes, body, positions):
    """That a page's drawing has its contacts where they are said to be, to a whole unit."""
    (drawn,) = (shape["points"] for shape in shapes if shape["role"] == "contact")
    points = body.center_of_mass + np.array(drawn) * body.radius / PER_RADIUS
    np.testing.assert_allclose(points, positions, atol=body.radius / PER_RADIUS)


def frames_of(path, *places):
    """The number of frames of a clip, and the pixels of some of them as whole numbers."""
    with Image.open(path) as clip:
        found = []
        for place in places:
            clip.seek(place % clip.n_frames)
            found.append(np.asarray(clip.convert("RGB")).astype(int))
        return clip.n_frames, *found
