"""Figures as people see them: numbers without rounding, and meanings that fit their headings."""

import math

import pytest

from grasp_core.figures import Shown, cell, figures
from grasp_core.values import Grasp
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.held_or_let_go import HoldVerdict
from sim_validate.execution.verdict import Execution, ExecutionTrial
from sim_validate.planning.best import Rated
from sim_validate.planning.regions import GraspRegions
from sim_validate.protocols.verdict import Judgement

KINDS = (Grasp, Verdict, HoldVerdict, Execution, ExecutionTrial, GraspRegions, Judgement, Rated)


def test_what_is_said_beside_a_scaled_number_names_no_other_unit():
    scaled = [each for kind in KINDS for each in figures(kind) if each.shown.times != 1.0]
    assert {"um moved", "planned mm", "mm slid", "radius mm"} <= {f.shown.heading for f in scaled}
    assert all("[" not in each.explained for each in scaled)
    (moved,) = (each for each in figures(Verdict) if each.shown.heading == "um moved")
    assert moved.meaning.endswith(" [m].")
    assert moved.explained == moved.meaning.replace(" [m]", "")


@pytest.mark.parametrize(
    ("value", "shown", "text"),
    [
        (-0.0, Shown(""), "0"), (-1e-9, Shown("", ".4f"), "0.0000"),
        (2.79e-34, Shown(""), "2.79e-34"), (2.79e-34, Shown("", rounding=1e-12), "0"),
        (1e-3, Shown("", ".3g", 1e3, rounding=1e-12), "1"), ((-0.0, 0.0), Shown(""), "0"),
        (math.inf, Shown(""), "never"), (-2.0, Shown("", least=-3.0), "-2"),
        (-1e6, Shown("", infinite="none", least=-1e6), "none"),
    ],
)  # fmt: skip
def test_a_cell_shows_no_sign_of_zero_no_rounding_and_no_sentinel(value, shown, text):
    assert cell(value, shown) == text
