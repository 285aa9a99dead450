"""Settings of executions, and the table `[execution]` of a file that holds them.

`tests/public_values` tries bad values of each.
"""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.settings import as_table
from scenes.example_objects import example_object
from scenes.settings import SAMPLE_S
from sim_validate.commands.config_file import flags_from
from sim_validate.commands.simulation_flags import Execute
from sim_validate.execution.paths import stop
from sim_validate.hands.trials import hand_execution_settings
from sim_validate.settings import TRIAL_KINDS, TrialKind

TABLE = {
    "density_kg_m3": 700, "trials": ["lift", "weight"], "tip_radius_m": 0.004, "down": [1, 0, 0],
}  # fmt: skip


def of_table(table):
    return sv.ExecutionSettings.of_table(table, "execution")


def test_a_table_says_how_objects_are_executed():
    asked = of_table(TABLE)
    assert asked.trials == ("weight", "lift")
    assert asked.down == (1.0, 0.0, 0.0)
    wedge = example_object("wedge")
    mass = wedge.mass_at(700.0)
    assert asked.for_body(wedge) == replace(asked, mass_kg=mass, density_kg_m3=None)
    assert of_table({"mass_kg": 2}).for_body(wedge) == sv.ExecutionSettings(mass_kg=2.0)


def test_trials_are_put_in_order_and_counted_once():
    chosen = sv.ExecutionSettings(0.1, trials=["knock", "lift", "knock"])
    assert chosen.trials == ("lift", "knock")
    assert sv.ExecutionSettings(0.1).trials == TRIAL_KINDS == get_args(TrialKind)


def test_the_duration_of_a_stop_is_limited():
    assert sv.ExecutionSettings(0.1, stop_m_per_s2=0.01, stop_from_m_per_s=1.0).seed == 0
    with pytest.raises(gc.InputError, match=r"stop_from_m_per_s .* at most 100 s, got 200 s"):
        sv.ExecutionSettings(0.1, stop_m_per_s2=0.01, stop_from_m_per_s=2.0)


@pytest.mark.parametrize("speed", [0.05, 0.5, 0.7, 3.0])
def test_a_stop_has_the_deceleration_asked_for_or_is_refused(speed):
    most = speed / SAMPLE_S
    for asked in (0.3 * most, most, float(f"{most:.12g}")):
        settings = sv.ExecutionSettings(0.1, stop_m_per_s2=asked, stop_from_m_per_s=speed)
        drive = stop(np.zeros(3), np.eye(3)[0], settings.stop_m_per_s2, speed)
        assert np.abs(drive.accelerations).max() == pytest.approx(asked, rel=1e-6)
    with pytest.raises(gc.InputError, match=f"or stop with at most {most:.6g} m/s"):
        sv.ExecutionSettings(0.1, stop_m_per_s2=2.0 * most, stop_from_m_per_s=speed)


@pytest.mark.parametrize(("mass_kg", "impulse"), [(0.3, 0.05), (0.0003, 5e-5), (6.0, 1.0)])
def test_the_usual_knock_gives_every_mass_the_same_speed(mass_kg, impulse):
    usual = sv.ExecutionSettings(mass_kg)
    assert usual.impulse_n_s == usual.used.knock_n_s == impulse
    assert replace(usual, mass_kg=0.3).impulse_n_s == 0.05
    given = sv.ExecutionSettings(mass_kg, knock_n_s=0.2)
    assert given.impulse_n_s == given.used.knock_n_s == 0.2
    assert sv.ExecutionSettings(mass_kg, knock_n_s=0.0).impulse_n_s == 0.0


USUAL = {
    "push_n": 10.0, "off_mm": 2.0, "max_mm": 5.0, "tip_mass_kg": 0.05,
    "tip_stiffness_n_per_m": 2000.0,
}  # fmt: skip


def of_size(radius_m):
    wedge = example_object("wedge")
    return gc.Polyhedron.from_mesh(radius_m / wedge.radius * wedge.vertices, wedge.triangles)


def numbers(settings):
    return {name: getattr(settings, name) for name in USUAL}


def test_what_is_left_at_its_default_is_fitted_to_small_objects():
    asked = sv.ExecutionSettings(mass_kg=0.0003)
    assert numbers(asked) == numbers(asked.for_body(of_size(0.0251))) == USUAL
    tiny = of_size(0.0025)
    found = asked.for_body(tiny)
    assert numbers(found) == pytest.approx({
        "push_n": 0.1, "off_mm": 0.2, "max_mm": 0.5, "tip_mass_kg": 0.0005,
        "tip_stiffness_n_per_m": 200.0,
    })  # fmt: skip
    assert found.for_body(tiny) == found
    assert sv.ExecutionSettings.of_table(as_table(found), "execution").for_body(tiny) == found


def test_numbers_that_are_given_stay_as_they_are():
    tiny = of_size(0.0025)
    found = sv.ExecutionSettings(mass_kg=0.0003, push_n=0.5, max_mm=1.0).for_body(tiny)
    assert (found.push_n, found.max_mm, found.off_mm) == (0.5, 1.0, pytest.approx(0.2))
    as_given = sv.ExecutionSettings(mass_kg=0.0003, keep_defaults=True)
    assert as_given.for_body(tiny) == as_given
    assert numbers(hand_execution_settings(0.0003).for_body(tiny)) == {**USUAL, "push_n": 100.0}
    changed = {"keep_defaults": as_given.keep_defaults}
    assert flags_from(changed, Execute) == ["--keep-defaults"]  # commands that repeat executions
