"""How grasps end that are executed with hands, and how well this is predicted.

    python -m tests.benchmarks.hand_executions [--grasps 10] [--stiffness 2000,20000] [--quick]

Built-in objects of 35 mm radius in the Allegro and the LEAP hand, at a third, all and three times
the mass that the squeeze is certified to carry. For each stiffness of the fingertips [N/m]: trials,
the share that survived, relative errors of the multiple of first slip where no contact slipped
(knocks left out: their loads come at once), how often a loss was predicted where none came and the
other way round, negative controls that slipped, and the time of one execution.
"""

import sys
import time
from dataclasses import replace

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.errors import InputError, NoForcesError
from sim_validate.hands.execute_hand import hand_execution_settings, hand_squeeze
from tests.benchmarks.reach import APPROACH_M, FRICTION, scaled

OBJECTS = ("box", "dodecahedron", "octahedron", "l-bracket", "wedge")
HANDS = ("allegro", "leap")
SHARES = (1 / 3, 1.0, 3.0)
TORQUE, MASS = 0.35, 0.1
PERCENT = 100.0


def cases(count):
    """Yield hands in poses, with the object."""
    for name in HANDS:
        hand = gc.load_hand(name).with_torque_limits(TORQUE, "a test")
        finger = gc.Finger(hand.fingers[0].tip.radius, APPROACH_M)
        for each in OBJECTS:
            body = scaled(scenes.example_object(each))
            for grasp in gc.plan(body, FRICTION, limit=count, finger=finger).grasps:
                reach = gc.reach_with(hand, body, grasp, FRICTION)
                if reach.reached:
                    yield hand, body, reach


def executed(case, stiffness):
    """Yield the executions of a pose, with their seconds; none where a hand cannot execute it."""
    hand, body, reach = case
    settings = replace(hand_execution_settings(MASS), stiffness_n_per_m=stiffness)
    try:
        able_kg = hand_squeeze(hand, body, reach, FRICTION, settings).scale * MASS
        for share in SHARES:
            begun = time.process_time()
            heavy = replace(settings, mass_kg=share * able_kg)
            yield sv.execute_hand(hand, body, reach, FRICTION, heavy), time.process_time() - begun
    except (InputError, NoForcesError) as error:
        print(f"  {reach.hand} {reach.grasp}: {error}"[:120])


def main():
    """Print a line for each stiffness; 1 if a control held."""
    words = sys.argv
    count = 2 if "--quick" in words else 10
    if "--grasps" in words:
        count = int(words[words.index("--grasps") + 1])
    given = words[words.index("--stiffness") + 1] if "--stiffness" in words else "2000,20000"
    poses, bad = list(cases(count)), 0
    print(f"{len(poses)} poses")
    for stiffness in map(float, given.split(",")):
        runs = [run for case in poses for run in executed(case, stiffness)]
        trials = [trial for found, _ in runs for trial in found.trials]
        clear = [
            trial for trial in trials
            if trial.kind not in {"knock", "misplaced"} and trial.fate == "stuck"
            and np.isfinite([trial.predicted_first_slip, trial.simulated_first_slip]).all()
        ]  # fmt: skip
        errors = PERCENT * np.abs(
            [each.simulated_first_slip / each.predicted_first_slip - 1.0 for each in clear]
        )
        apart = [trial for trial in trials if trial.kind != "misplaced"]
        lost = np.array([trial.predicted_loss < 1.0 for trial in apart])
        kept = np.array([trial.survived for trial in apart])
        controls = [control.let_go for found, _ in runs for control in found.controls]
        bad += len(controls) - sum(controls)
        seconds = np.array([each for _, each in runs])
        print(
            f"{stiffness:g} N/m: {len(runs)} executions, {len(trials)} trials, "
            f"{np.mean([trial.survived for trial in trials]):.1%} survived; first slip of "
            f"{len(clear)} that stuck: median {np.median(errors):.2f} %, 95 % within "
            f"{np.quantile(errors, 0.95):.2f} %; predicted lost, kept {np.mean(lost & kept):.1%},"
            f" kept and lost {np.mean(~lost & ~kept):.1%}; controls that slipped "
            f"{sum(controls)} of {len(controls)}; median {np.median(seconds):.2f} s"
        )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
