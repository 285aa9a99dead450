"""Settings of executions, and the table `[execution]` of a file that holds them.

`tests/public_values` tries bad values of each.
"""

from dataclasses import replace
from typing import get_args

import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.settings import KINDS, TrialKind

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
    assert sv.ExecutionSettings(0.1).trials == KINDS == get_args(TrialKind)


def test_the_duration_of_a_stop_is_limited():
    assert sv.ExecutionSettings(0.1, stop_m_per_s2=0.01, stop_from_m_per_s=1.0).seed == 0
    with pytest.raises(gc.InputError, match=r"stop_from_m_per_s .* at most 100 s, got 200 s"):
        sv.ExecutionSettings(0.1, stop_m_per_s2=0.01, stop_from_m_per_s=2.0)


@pytest.mark.parametrize(("mass_kg", "impulse"), [(0.3, 0.05), (0.0003, 5e-5), (6.0, 1.0)])
def test_the_usual_knock_gives_every_mass_the_same_speed(mass_kg, impulse):
    usual = sv.ExecutionSettings(mass_kg)
    assert usual.impulse_n_s == usual.used.knock_n_s == impulse
    assert replace(usual, mass_kg=0.3).impulse_n_s == 0.05
    given = sv.ExecutionSettings(mass_kg, knock_n_s=0.2)
    assert given.impulse_n_s == given.used.knock_n_s == 0.2
    assert sv.ExecutionSettings(mass_kg, knock_n_s=0.0).impulse_n_s == 0.0
