"""Our imitation of DexGraspBench's test beside its own evaluator, on 48 records of each hand.

    python -m tests.benchmarks.dexgraspbench write FOLDER
    python -m tests.benchmarks.dexgraspbench compare FOLDER

The first writes records of grasps of six built-in objects by Allegro and LEAP, for its evaluator to
judge: in its checkout, for each hand, with its own MuJoCo,

    python src/main.py hand=HAND task=eval exp_name=records save_root=FOLDER

The second judges the same files here and prints how many verdicts are alike. It ends with an error
if more than three differ.
"""

import argparse
import sys
from itertools import islice
from pathlib import Path

import numpy as np

import grasp_core as gc
import sim_validate as sv
from tests.benchmarks.objects import scaled

OBJECTS = {
    "dodecahedron": 0.032, "box": 0.033, "wedge": 0.035, "octahedron": 0.035, "icosahedron": 0.032,
    "hexagonal-pyramid": 0.036,
}  # fmt: skip
"""Radii by name [m]."""
HANDS, EACH, FRICTION, MOST_APART = ("allegro", "leap"), 8, 0.5, 3
TORQUE_N_M = 0.7
"""Limit of joints in our own trials; DexGraspBench has none."""


def reached(hand, body):
    """Yield poses that have an opening."""
    finger = gc.Finger(radius_m=0.012, approach_m=0.03)
    for grasp in gc.plan(body, FRICTION, limit=200, finger=finger).grasps:
        found = gc.reach_with(hand, body, grasp, FRICTION, starts=40)
        if found.pregrasp is not None:
            yield found


def write(folder):
    for hand in map(gc.load_hand, HANDS):
        place = folder / f"records_{hand.name}" / "graspdata"
        for name in OBJECTS:
            body = scaled(name, OBJECTS[name])
            seen = str(sv.write_dex_object(body, folder / "objects" / name).resolve())
            for number, found in enumerate(islice(reached(hand, body), EACH)):
                record = sv.dex_record(hand, found, seen)
                sv.write_dex_record(record, place / f"{name}_{number}.npy")
    return 0


def compare(folder):
    alike = total = 0
    for name in HANDS:
        hand = gc.load_hand(name).with_torque_limits(TORQUE_N_M, "the benchmark")
        theirs, ours = [], []
        for path in sorted((folder / f"records_{name}" / "graspdata").glob("*.npy")):
            judged = folder / f"records_{name}" / "evaluation" / path.name
            theirs.append(bool(np.load(judged, allow_pickle=True).item()["succ_flag"]))
            about = path.stem.rsplit("_", 1)[0]
            body = scaled(about, OBJECTS[about])
            found = sv.reach_of_record(sv.load_dex_record(path), hand, body, FRICTION)
            verdict = sv.judge_hand_by("dexgraspbench", hand, body, found, FRICTION)
            ours.append(verdict.theirs)
        same = sum(map(bool.__eq__, theirs, ours))
        print(f"{name}: {same} of {len(ours)} alike; passed {sum(theirs)} there, {sum(ours)} here")
        alike, total = alike + same, total + len(ours)
    print(f"{alike} of {total} verdicts are alike")
    return 0 if total - alike <= MOST_APART else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("write", "compare"))
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    return write(options.folder) if options.what == "write" else compare(options.folder)


if __name__ == "__main__":
    sys.exit(main())
