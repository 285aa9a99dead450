import dataclasses
from functools import cache
from itertools import product

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution import best_squeeze as module
from grasp_core.execution.loads import Reactions
from scenes.example_objects import example_object
from tests.grasp_core.execution.held import ASIDE, HALF, bodies_and_grasps, box, opposed
from tests.tampering import squeezes
from tests.tampering.changes import forged

G = 9.80665
ANY = gc.any_direction(1.0)
SHAKEN = gc.LoadSet([0, 0, -2.0, 0, 0, 0], np.diag([0.5, 0.5, 0.5, 0.01, 0.01, 0.01]))


@pytest.mark.parametrize("friction", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("stiffness", [300.0, 1e8])
def test_four_opposed_fingers_carry_the_mass_of_the_closed_form(friction, stiffness):
    """Each finger takes a quarter of the load: with a push n at rest it survives m g / 4 in all
    directions if m g / 4 sqrt(1 + mu^2) <= mu n, and its push stays below n + m g / 4 = N.
    """
    found = gc.best_squeeze(
        box(), opposed(), friction, ANY, max_push_n=10.0, stiffness=stiffness, tip_radius_m=0.03
    )
    mass = 4.0 * friction * 10.0 / (G * (np.sqrt(1.0 + friction**2) + friction))
    assert found.scale == pytest.approx(mass, rel=1e-4)
    assert found.scale <= mass * (1.0 + 1e-7) <= found.upper * (1.0 + 1e-6)
    assert found.grip.local_squeeze[:, 0] == pytest.approx(10.0 - mass * G / 4.0, rel=1e-3)
    assert found.verify()


@cache
def best_squeezes():
    """Squeezes of planned grasps, and what limits their pushes."""
    found = []
    for stiffness, (body, grasp) in zip((500.0, 1000.0, 3000.0), bodies_and_grasps(), strict=True):
        for each, most in product((ANY, SHAKEN), (10.0, None)):
            given = {"max_push_n": most, "stiffness": stiffness}
            found.append((gc.best_squeeze(body, grasp, 0.5, each, **given), most))
    return found


def test_squeezes_are_proved_and_true_by_definition():
    """By the springs' own equations and linear programs; the gap to the bound is below 3e-4."""
    for found, most in best_squeezes():
        assert found.verify()
        assert found.scale <= found.upper <= found.scale * (1.0 + 3e-4)
        if most is None:
            assert 1.0 <= found.scale < 1.001
        assert squeezes.squeeze(found)


def test_the_worst_load_is_a_first_slip():
    for found, _ in best_squeezes()[::4]:  # under loads without an offset
        slip = gc.first_slip(
            found.grip, found.load, model="linear", max_push_n=found.max_push_n * (1.0 + 1e-9)
        )
        assert slip.multiple == pytest.approx(1.0, rel=1e-4)


def test_least_push_and_most_scale_are_inverse():
    """Where there is no offset, and fingertips are stiff, or the push found is asked for again."""
    for body, grasp in bodies_and_grasps():
        least = gc.best_squeeze(body, grasp, 0.5, ANY, stiffness=1000.0)
        again = gc.best_squeeze(
            body, grasp, 0.5, ANY, max_push_n=least.max_push_n, stiffness=1000.0
        )
        assert again.scale == pytest.approx(1.0, rel=5e-4)


def test_last_digits_of_contacts_move_a_squeeze_by_last_digits():
    """The nearest of equal optima is taken, so that rounding by 1e-13 does not choose another."""
    rng = np.random.default_rng(0)
    for body, grasp in bodies_and_grasps():
        first = gc.best_squeeze(body, grasp, 0.5, ANY, max_push_n=10.0)
        shaken = [
            gc.Contact(c.position + 1e-13 * rng.normal(size=3), c.normal) for c in grasp.contacts
        ]
        second = gc.best_squeeze(body, shaken, 0.5, ANY, max_push_n=10.0)
        assert second.grip.squeeze == pytest.approx(first.grip.squeeze, abs=1e-5)
        assert second.scale == pytest.approx(first.scale, rel=1e-6)


def test_without_friction_nothing_is_survived():
    found = gc.best_squeeze(box(), opposed(), 0.0, ANY, max_push_n=10.0)
    assert found.scale == 0.0
    assert found.upper < 1e-9
    assert found.verify()
    with pytest.raises(gc.NoForcesError, match="no balanced squeeze survives the loads"):
        gc.best_squeeze(box(), opposed(), 0.0, ANY)
    with pytest.raises(gc.NoForcesError, match="survives the offset of the loads"):
        gc.best_squeeze(box(), opposed(), 0.0, SHAKEN, max_push_n=10.0)


def test_unstable_grips_are_reported():
    assert HALF > ASIDE
    soft = {"stiffness": 100.0, "tip_radius_m": 0.0}
    with pytest.raises(gc.NoForcesError, match=r"unstable under .* a smaller limit of pushes"):
        gc.best_squeeze(box(), opposed(), 0.5, ANY, max_push_n=100.0, **soft)
    heavy = gc.any_direction(5.0)
    with pytest.raises(gc.NoForcesError, match=r"unstable under .* smaller loads"):
        gc.best_squeeze(box(), opposed(), 0.5, heavy, **soft)
    assert gc.best_squeeze(box(), opposed(), 0.5, ANY, max_push_n=0.5, **soft).grip.stable


def test_nonsense_is_no_certificate():
    found = gc.best_squeeze(box(), opposed(), 0.5, ANY, max_push_n=10.0)
    tested = 0
    for field in dataclasses.fields(found):
        for value in (None, "a", np.nan, -1.0, np.inf, np.zeros(0), ()):
            if value is getattr(found, field.name):  # no motors are none
                continue
            assert forged(found, **{field.name: value}).verify() is False
            tested += 1
    assert tested == 90
    for change in (
        {"scale": found.scale * 1.001}, {"upper": found.scale * 0.999},
        {"upper": found.upper * (1.0 - 1e-4)}, {"max_push_n": 9.99},
        {"direction": -found.direction[[1, 2, 0]]}, {"proofs": 0.5 * found.proofs},
        {"multipliers": 0.0 * found.multipliers},
    ):  # fmt: skip
        assert not forged(found, **change).verify(), change


def test_a_squeeze_that_is_not_found_or_proved_is_an_error(monkeypatch):
    monkeypatch.setattr(Reactions, "survives", lambda *_: False)
    with pytest.raises(gc.SolverError, match="proof that the squeeze survives its loads fails"):
        gc.best_squeeze(box(), opposed(), 0.5, ANY, max_push_n=10.0)
    monkeypatch.setattr(module, "MOST_SQUEEZE_PROGRAMS", 0)
    with pytest.raises(gc.SolverError, match="no squeeze was found to survive the loads"):
        gc.best_squeeze(box(), opposed(), 0.5, ANY, max_push_n=10.0)


@pytest.mark.parametrize("above", [0.5, 1e-2, 1e-4])
def test_false_claims_are_small_beside_scales_near_the_critical_friction(above):
    """Scales are small beside the largest push there: no slack is a share of that."""
    body = example_object("wedge")
    (grasp,) = gc.plan(body, 0.5, limit=1).grasps
    mu = gc.critical_friction(grasp) * (1.0 + above)
    axes = np.diag(np.repeat([1.0, body.radius], 3))
    found = gc.best_squeeze(body, grasp, mu, gc.LoadSet(np.zeros(6), axes), max_push_n=10.0)
    assert found.verify()
    lower = dataclasses.replace(found, scale=0.99 * found.scale, upper=found.upper * (1.0 - 1e-6))
    assert not lower.verify()
    # a squeeze that is off balance counts as that into which the object moves by itself
    off = forged(found.grip, squeeze=found.grip.squeeze + 1e-7 * found.grip.normals)
    assert np.abs(off.left).max() > 1e-9
    settled = np.einsum("kij,kj->ki", off.frames, off.settled)
    assert np.abs(forged(off, squeeze=settled).left).max() < 1e-3 * np.abs(off.left).max()
