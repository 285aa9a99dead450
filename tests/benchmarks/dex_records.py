"""Hands in planned grasps as DexGraspBench's records: `python -m tests.benchmarks.dex_records`.

Grasps of five built-in objects are reached with the Allegro hand, recorded, read as DexGraspBench
reads them (`numpy.load` with trust, and the dictionary's fields) and as we do, and judged by
DexGraspBench's test with joints that are limited to 0.7 N m. Printed are how many records are read,
how far contacts are off after the round trip, and how many hands pass. Ends with an error if a
record is not read, or a contact is off by more than a nanometre.

    python -m tests.benchmarks.dex_records [--quick] [--read-only] [--jobs N]
"""

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.parallel.processes import available_cores, each

OBJECTS = (
    ("dodecahedron", 0.032), ("box", 0.033), ("wedge", 0.035), ("octahedron", 0.035),
    ("icosahedron", 0.032),
)  # fmt: skip
"""Names and radii [m]."""
FRICTION, TORQUE_N_M, SAME_M = 0.5, 0.7, 1e-9
EACH, QUICK_EACH, RECORDS = 140, 6, 500


def scaled(name, radius):
    body = scenes.example_object(name)
    vertices = (body.vertices - body.center_of_mass) * radius / body.radius
    return gc.Polyhedron.from_mesh(vertices, body.triangles, name=name)


def recorded(case):
    """Reach a grasp, write and read its record, and judge it if asked; None if not reached."""
    body, grasp, is_judged = case
    hand = gc.load_hand("allegro").with_torque_limits(TORQUE_N_M, "the benchmark")
    reach = gc.reach_with(hand, body, grasp, FRICTION)
    if not reach.reached:
        return None
    with TemporaryDirectory() as folder:
        path = sv.write_dex_record(sv.dex_record(hand, reach, "object"), Path(folder) / "0.npy")
        data = np.load(path, allow_pickle=True).item()
        read = sv.load_dex_record(path)
    whole = np.concatenate([data["pregrasp_qpos"], data["obj_pose"]])
    theirs = len(whole) == 30 and np.array_equal(data["squeeze_qpos"], read.squeeze)
    again = sv.reach_of_record(read, hand, body, FRICTION)
    if not again.reached:
        return theirs, np.inf, False
    order = np.argsort(reach.fingers)
    off = max(
        float(np.abs(one.position - reach.contacts[place].position).max())
        for one, place in zip(again.contacts, order, strict=True)
    )
    if not is_judged:
        return theirs, off, None
    return theirs, off, sv.judge_hand_by("dexgraspbench", hand, body, again, FRICTION).theirs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--read-only", action="store_true", help="leave out the test")
    parser.add_argument("--jobs", type=int, default=available_cores())
    options = parser.parse_args()
    count = QUICK_EACH if options.quick else EACH
    finger = gc.Finger(radius_m=0.012, approach_m=0.03)
    cases = [
        (body, grasp, not options.read_only)
        for body in (scaled(*each) for each in OBJECTS)
        for grasp in gc.plan(body, FRICTION, limit=count, finger=finger).grasps
    ]
    begun = time.time()
    found = [one for one in each(recorded, cases, jobs=options.jobs) if one is not None][:RECORDS]
    theirs, off = sum(one[0] for one in found), max(one[1] for one in found)
    judged = [one[2] for one in found if one[2] is not None]
    print(
        f"{len(cases)} grasps, {len(found)} records: {theirs} read as DexGraspBench does; contacts "
        f"are off by at most {off:.1e} m after the round trip; {sum(judged)} of {len(judged)} pass "
        f"its test; {time.time() - begun:.0f} s"
    )
    return 0 if theirs == len(found) and off < SAME_M else 1


if __name__ == "__main__":
    sys.exit(main())
