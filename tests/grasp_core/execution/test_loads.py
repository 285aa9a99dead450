import numpy as np
import pytest

import grasp_core as gc

G = 9.80665


def test_a_weight_in_any_direction_is_a_ball_of_forces():
    loads = gc.any_direction(0.5, 2.0)
    assert not loads.offset.any()
    assert loads.axes[:3] == pytest.approx(0.5 * (G + 2.0) * np.eye(3))
    assert not loads.axes[3:].any()


def test_gravity_of_a_palm_that_does_not_turn_is_the_offset():
    loads = gc.any_direction(0.5, 2.0, gravity=[0.0, 0.0, -G])
    assert loads.offset == pytest.approx([0, 0, -0.5 * G, 0, 0, 0])
    assert loads.axes[:3] == pytest.approx(np.eye(3))


def test_arrays_are_read_only():
    loads = gc.any_direction(1.0)
    for part in (loads.offset, loads.axes):
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: gc.any_direction(0.0), "mass_kg must be a number from"),
        (lambda: gc.any_direction(1.0, -1.0), "acceleration_m_per_s2 must be a number from 0"),
        (lambda: gc.any_direction(1.0, gravity=[0, 0, -G]), "must be above zero where"),
        (lambda: gc.any_direction(1.0, 1.0, gravity=[0, 0]), "gravity must have shape"),
        (lambda: gc.LoadSet(np.zeros(6), np.zeros((6, 2))), "axes must not be zero"),
        (lambda: gc.LoadSet(np.zeros(6), np.ones((6, 7))), "axes must have 1 to 6 columns, got 7"),
        (lambda: gc.LoadSet(np.zeros(5), np.eye(6)), "offset must have shape"),
        (lambda: gc.LoadSet(np.full(6, np.nan), np.eye(6)), "offset must be finite"),
    ],
)
def test_what_is_wrong_is_refused(make, message):
    with pytest.raises(gc.InputError, match=message):
        make()
