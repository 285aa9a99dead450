"""Executions as a file holds them: one lost, one survived, one without a squeeze."""

import math
from dataclasses import replace

import numpy as np

import scenes
import sim_validate as sv
from sim_validate.execution.verdict import (
    Enough,
    Execution,
    ExecutionControl,
    Executions,
    ExecutionTrial,
    Skipped,
)
from sim_validate.files.result_files import AboutObject

SETTINGS = sv.ExecutionSettings(
    mass_kg=0.3, trials=("shake", "lift"), seed=7, shake_g=0.0, knock_n_s=0.02,
    tip_mass_kg=0.02, damping_ratio=0.7, down=(1.0, 0.0, -1.0),
)  # fmt: skip
LOST = ExecutionTrial(
    "lift", "lift", False, "dropped", 0.01, 0.2, 1.0 / 3.0, 0.4, 0.45, 0.41, 0.00125
)
ENOUGH = Enough(1.5, 12.5, 4000.0, math.inf)
NONE = Enough(1.5, reason="it is proved")
KEPT = ExecutionTrial(
    "shake", "shake along x", True, "stuck", 0.0, 1e-4, 0.1, math.inf, 3.0, math.inf, 0.00125
)
FOUND = Execution(
    mass_kg=0.3, squeeze=np.arange(12.0).reshape(4, 3) / 7.0, load_multiple=2.5,
    trials=(LOST, KEPT),
    controls=(ExecutionControl("friction 0.9", True, 0.89), ExecutionControl("x", False, math.inf)),
    skipped=(Skipped("stop", "a reason"),),
    physics=scenes.PhysicsSettings(timestep=0.00125, impratio=100.0),
    tip_radius_m=np.array([0.004, 0.004, 0.004, 0.005]), enough=ENOUGH,
)  # fmt: skip
GRASPS = (
    sv.ExecutedGrasp("c-0-1-2-3", "concurrent", "0" * 64, FOUND, None, ENOUGH),
    sv.ExecutedGrasp(
        "p-0-1-2-3", "pencil", "1" * 64,
        replace(FOUND, trials=(KEPT,), physics=None, tip_radius_m=None, enough=None),
    ),
    sv.ExecutedGrasp("r-0-1-2-3", "regulus", "2" * 64, None, "no squeeze carries the weight", NONE),
)  # fmt: skip
BODY = scenes.example_object("tetrahedron")
PLAIN = ExecutionTrial("knock", "knock", True, "stuck", 0.0, 0.0, 0.0, 2.0, 3.0, 2.0, 1e-3)
"""A trial that nothing happened in."""


def trial(kind, name=None, **figures):
    return replace(PLAIN, kind=kind, name=name or kind, **figures)


def execution(*trials, **figures):
    """One of 0.3 kg that was made by hand, without controls unless they are given."""
    made = Execution(0.3, np.full((4, 3), 2.0), 2.0, trials, (), ())
    return replace(made, **figures)


def executions(complete=True):
    """What the file of these grasps holds."""
    return Executions(AboutObject.of(BODY), 0.5, SETTINGS, GRASPS, complete=complete)
