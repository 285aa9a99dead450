"""Verdicts and motions of executions beside those of short steps throughout.

    python -m tests.benchmarks.short_steps [--draws 1000] [--seed 0]

Hulls, prisms and the L between fingertips that push with 0.1 to 10 N, with 0.5, 0.9 and 1.4 of the
mass that their squeeze is predicted to hold, in all trials of an execution: as executions simulate
them, and every trial with steps of 1/8 ms from its start to its end.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
import trimesh

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.execution import confirming
from sim_validate.execution.confirming import confirmed_trials, confirming_benches, run_trials
from sim_validate.execution.execute import OUT_OF_REACH
from sim_validate.execution.holders import SpringFingers, planned
from sim_validate.execution.simulate import HeldBench
from tests.benchmarks.objects import sphere_hull

RADIUS_M = 0.04
FRICTIONS, SHARES = (0.3, 0.4, 0.5, 0.8), (0.5, 0.9, 1.4)
GRASPS = 12
"""Grasps of an object, of which one is drawn."""
MOST_DIFFERENT = 3
"""Verdicts in a thousand that may differ, each near a limit."""
NEAR_M, NEAR_RAD = 1e-4, np.radians(1.0)
"""How near to a limit the motion with short steps is then, one or the other."""
MOST_OFF_M, MOST_OFF_RAD = 3e-4, np.radians(0.5)
"""How far motions of kept objects may be off, in 99 of 100."""


def drawn_body(rng):
    kind = rng.integers(3)
    if kind == 0:
        made = sphere_hull(2 * int(rng.integers(4, 10)), seed=int(rng.integers(1000)))
    elif kind == 1:
        angles = np.linspace(0.0, 2.0 * np.pi, int(rng.integers(3, 9)), endpoint=False)
        ring = np.column_stack([np.cos(angles), np.sin(angles), np.full(len(angles), 0.75)])
        hull = trimesh.convex.convex_hull(np.vstack([ring, ring * (1.0, 1.0, -1.0)]))
        made = gc.Polyhedron.from_mesh(hull.vertices, hull.faces, name=f"prism of {len(angles)}")
    else:
        return scenes.example_object("l-bracket")
    vertices = RADIUS_M * (made.vertices - made.center_of_mass) / made.radius
    return gc.Polyhedron.from_mesh(vertices, made.triangles, name=made.name, faces="planar")


def drawn_execution(rng):
    """A bench with the trials and predictions of a random grasp, and its settings."""
    while True:
        body, friction = drawn_body(rng), float(rng.choice(FRICTIONS))
        push_n, share = float(10.0 ** rng.uniform(-1.0, 1.0)), float(rng.choice(SHARES))
        grasps = gc.plan(body, friction, limit=GRASPS, rank_by="diverse").grasps
        if not grasps:
            continue
        grasp = grasps[int(rng.integers(len(grasps)))]
        loose = sv.ExecutionSettings(mass_kg=1.0, push_n=push_n).for_body(body)
        held = gc.payload(
            body, grasp, friction, max_push_n=push_n, stiffness=loose.tip_stiffness_n_per_m
        )
        settings = replace(loose, mass_kg=share * held.mass_kg)
        fingers = SpringFingers(body, grasp.contacts, friction)
        try:
            best = fingers.squeeze(settings)
        except gc.NoForcesError:  # the grip is unstable
            continue
        scene, dynamics, trials, _ = planned(fingers, settings, best)
        lost_m = max(OUT_OF_REACH * body.radius, 2.0 * settings.most_m)
        predicted = dict(zip(trials, dynamics.losses(trials, settings), strict=True))
        return HeldBench(scene, lost_m=lost_m), predicted, settings


def is_near(trial, settings):
    """Whether the motion of a trial is near what is allowed."""
    off_m, off_rad = trial.displacement_m - settings.most_m, trial.turn_rad - settings.most_rad
    return abs(off_m) <= NEAR_M or abs(off_rad) <= NEAR_RAD


def main():
    """Print the figures; 1 if a verdict or motion is off by more than it may be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=1000, help="least number of trials")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    count = again = lost = 0
    spent, off, differing = np.zeros(2), [], []
    while count < options.draws:
        bench, predicted, settings = drawn_execution(rng)
        (*_, short), begun = confirming_benches(bench), time.process_time()
        motions = run_trials(bench, tuple(predicted))
        usual = confirmed_trials(bench, motions, predicted, settings)
        between = time.process_time()
        motions = run_trials(short, tuple(predicted))
        right = {
            trial: confirming._judged(trial, motion, predicted[trial], short, settings)
            for trial, motion in motions.items()
        }
        spent += between - begun, time.process_time() - between
        count += len(predicted)
        again += sum(each.step_s < bench.step_s for each in usual.values())
        for trial, here in usual.items():
            there = right[trial]
            lost += not there.survived
            if here.survived != there.survived:
                differing.append((bench.scene.layout, here, there, is_near(there, settings)))
            elif here.survived:
                turned = abs(here.turn_rad - there.turn_rad)
                off.append((abs(here.displacement_m - there.displacement_m), turned))
    for layout, here, there, near in differing:
        print(f"{layout.name} of {1e3 * layout.object_kg:.3g} g, {here.name}: {here}\n    {there}"
              f"{'' if near else ', far from a limit'}")  # fmt: skip
    (moved, turned), allowed = np.percentile(off, 99, axis=0), options.draws / 1000 * MOST_DIFFERENT
    print(
        f"{count} trials, {lost} lost, {again} run again, {len(differing)} verdicts differ, "
        f"{sum(not near for *_, near in differing)} of them far from a limit; 99 % of {len(off)} "
        f"kept objects within {1e3 * moved:.2g} mm and {np.degrees(turned):.2g} degrees; "
        f"{spent[0]:.0f} s instead of {spent[1]:.0f}"
    )
    far = len(differing) > allowed or not all(near for *_, near in differing)
    return int(far or moved > MOST_OFF_M or turned > MOST_OFF_RAD)


if __name__ == "__main__":
    raise SystemExit(main())
