import math

import numpy as np

from grasp_core.frames import kept_angle, radians_of

ANGLES = [
    float(scale * share)
    for scale in (1e-12, 1e-3, 0.1, math.pi / 2)
    for share in np.random.default_rng(0).uniform(size=2000)
]


def test_an_angle_that_was_written_is_read_as_it_was():
    changed = 0
    for angle in ANGLES:
        kept = kept_angle(angle)
        assert math.degrees(kept) == math.degrees(angle)
        assert radians_of(math.degrees(kept)) == kept
        assert abs(kept - angle) <= math.ulp(angle)
        changed += math.radians(math.degrees(kept)) != kept
    assert changed > 100  # the plain conversion would miss so many


def test_round_numbers_of_degrees_are_converted_as_usual():
    for degrees in (0.0, 10.0, 45.0, 90.0, 1e-9):
        assert radians_of(degrees) == math.radians(degrees)
