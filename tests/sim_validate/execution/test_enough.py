"""The push and stiffness that are said to be enough: executed again with them, objects are kept."""

from dataclasses import replace

import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.execution.enough import NO_LOSS, NoSqueezeError
from sim_validate.execution.execute import SpringFingers
from sim_validate.execution.verdict import losses_in_words
from sim_validate.hands.execute import hand_execution_settings
from tests.grasp_core.execution.held import box
from tests.grasp_core.hands.gripping import FRICTION, scaled
from tests.sim_validate.execution.held_rigs import G, opposed, planned
from tests.sim_validate.hands.executing import MASS, OBJECT, RADIUS, stood

MOVING = ("weight", "shake", "stop")
LOST = {
    "heavy": ("wedge", {"mass_kg": 8.0}),
    "weak": ("box", {"mass_kg": 2.0, "push_n": 2.0}),
    "soft": ("dodecahedron", {"mass_kg": 1.0, "push_n": 40.0, "tip_stiffness_n_per_m": 700.0}),
    "knocked": ("l-bracket", {"mass_kg": 0.6, "push_n": 3.0, "trials": (*MOVING, "knock")}),
    "unstable": ("wedge", {"mass_kg": 0.3, "push_n": 300.0}),
}
"""Objects and settings with which a grasp is lost, or has no squeeze."""


def lost(name):
    """A grasp, its settings, and what is said to be enough for them."""
    object_name, given = LOST[name]
    body, grasp = planned(object_name)
    settings = sv.ExecutionSettings(**{"trials": MOVING, **given})
    try:
        found = sv.execute(body, grasp, 0.5, settings)
    except NoSqueezeError as error:
        return body, grasp, settings, error.enough
    assert not found.survived
    assert losses_in_words(found)[0].endswith(f" trials; {found.enough}")
    return body, grasp, settings, found.enough


@pytest.mark.parametrize(
    "name",
    ["soft", "unstable"]
    + [pytest.param(name, marks=pytest.mark.slow) for name in ("heavy", "weak", "knocked")],
)
def test_a_grasp_survives_with_what_is_said_to_be_enough(name):
    body, grasp, settings, enough = lost(name)
    chosen = replace(settings, push_n=enough.push_n, tip_stiffness_n_per_m=enough.stiffness_n_per_m)
    again = sv.execute(body, grasp, 0.5, chosen)
    assert again.survived, losses_in_words(again)
    assert again.enough is None
    assert again.load_multiple == enough.load_multiple
    assert again.least_predicted_loss == enough.predicted_loss >= NO_LOSS
    assert enough.stiffness_n_per_m >= settings.tip_stiffness_n_per_m
    assert (enough.push_n < settings.push_n) == (name in {"soft", "unstable"})


def test_the_push_is_the_least_for_loads_that_are_a_formula():
    """Slow shakes: nothing overshoots, and the loads are the weight and their acceleration."""
    settings = sv.ExecutionSettings(
        0.5, push_n=3.0, trials=("shake",), shake_g=0.6, shake_hz=1.0, tip_radius_m=0.005
    )
    enough = sv.execute(box(), opposed(), 0.5, settings).enough
    assert enough.stiffness_n_per_m == settings.tip_stiffness_n_per_m
    loads = gc.any_direction(0.5, 0.6 * G)
    least = gc.best_squeeze(box(), opposed(), 0.5, loads, stiffness=2000.0, tip_radius_m=0.005)
    assert least.verify()
    assert least.max_push_n <= enough.push_n <= 1.011 * least.max_push_n
    assert enough.load_multiple == pytest.approx(1.6, rel=0.012)
    less = SpringFingers(box(), opposed(), 0.5).squeeze(
        replace(settings, push_n=0.98 * enough.push_n)
    )
    assert less.upper < 1.6


@pytest.mark.slow
def test_the_stiffness_is_the_least_that_keeps_the_object_in_its_place():
    """A heavy object bends soft springs farther than it may go, whatever the push."""
    body, grasp, settings, enough = lost("heavy")
    assert enough.stiffness_n_per_m > 1.5 * settings.tip_stiffness_n_per_m
    softer = enough.stiffness_n_per_m / 1.2
    less = replace(settings, push_n=enough.push_n, tip_stiffness_n_per_m=softer)
    assert sv.execute(body, grasp, 0.5, less).least_predicted_loss < NO_LOSS


def test_where_no_push_is_enough_a_proof_says_so():
    body, grasp = planned("wedge")
    assert not gc.force_closure(grasp, friction=0.03).closed
    with pytest.raises(NoSqueezeError, match="it is proved that no balanced squeeze") as raised:
        sv.execute(body, grasp, 0.03, sv.ExecutionSettings(0.3, trials=("weight",)))
    assert raised.value.enough.push_n is None
    assert str(raised.value).endswith(f"; {raised.value.enough}")
    assert raised.value.enough.load_multiple == 1.0
    reach, hand = stood("allegro")
    heavy = replace(hand_execution_settings(100.0 * MASS), trials=("weight",))
    found = sv.execute_hand(hand, scaled(OBJECT, RADIUS), reach, FRICTION, heavy)
    assert found.enough.push_n is None
    assert "no balanced squeeze within the torques of the joints" in found.enough.reason


@pytest.mark.slow
def test_a_hand_says_what_is_enough_within_its_torques():
    reach, hand = stood("allegro")
    body = scaled(OBJECT, RADIUS)
    weak = replace(hand_execution_settings(MASS), trials=("weight", "stop"), push_n=0.25)
    found = sv.execute_hand(hand, body, reach, FRICTION, weak)
    assert not found.survived
    enough = found.enough
    again = replace(weak, push_n=enough.push_n, tip_stiffness_n_per_m=enough.stiffness_n_per_m)
    assert sv.execute_hand(hand, body, reach, FRICTION, again).survived


def test_nothing_is_sought_where_nothing_is_lost_or_asked_for():
    body, grasp = planned("box")
    light = sv.ExecutionSettings(0.1, trials=("weight",))
    assert sv.execute(body, grasp, 0.5, light).enough is None
    weak = replace(light, push_n=0.1)
    assert sv.execute(body, grasp, 0.5, weak, enough=False).enough is None
    with pytest.raises(gc.NoForcesError) as raised:
        sv.execute(body, grasp, 0.001, light, enough=False)
    assert not isinstance(raised.value, NoSqueezeError)
