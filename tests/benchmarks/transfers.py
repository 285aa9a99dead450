"""Are grasps carried over to changed parts as stated, and judged as by hand?

    python -m tests.benchmarks.transfers [--quick]

Up to twenty grasps of each of eleven objects are carried over to the object with a face moved by
0.1 to 5 mm in or out, with a hole drilled under or beside a contact, and with an edge cut off.
Then, without the package's own way of carrying:

* every carried contact has to lie on a triangle of the changed part, with its normal, and nowhere
  may a like triangle be nearer to where it was;
* every contact that was not carried must have no like triangle within the stated distance;
* force closure, critical friction and quality, at friction 0.5 and 0.06, have to be those that
  `graspproof analyze` gives for a contacts file with the same contacts;
* one grasp of each changed part is made by hand of its contacts and simulated; its verdict has to
  be that of the carried grasp.

Any difference ends it with an error. Some four minutes; `--quick` takes three objects.
"""

import argparse
import contextlib
import io
import json
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import grasp_core as gc
import sim_validate as sv
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.planning.given_contacts import grasp_of, seat
from scenes.example_objects import example_object
from sim_validate.main import main as graspproof
from tests.changed_parts import (
    is_on_surface,
    nearest_like,
    with_chamfer,
    with_face_moved,
    with_hole,
)

OBJECTS = ("box", "l-bracket", "prism", "wedge", "chamfered-box", "hex-nut", "double-wedge-bar",
           "tetrahedron", "octahedron", "hexagonal-pyramid", "dodecahedron")  # fmt: skip
QUICK = OBJECTS[:3]
GRASPS, FEWEST_GRASPS = 20, 200
FRICTION, ANGLE_DEG = 0.5, 5.0
LITTLE = 0.06
"""Friction at which many of the grasps are not in force closure."""
MOVES_MM = (-5.0, -1.0, -0.1, 0.1, 0.3, 1.0, 3.0, 5.0)
HOLES_MM = (1.5, 6.0)
CHAMFERS_MM = (1.0, 6.0)
ROUNDING = 1e-9
"""Difference of distances, relative to the part, and of proved numbers, that is rounding."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    counts, begun, took = Counter(), time.perf_counter(), 0.0
    for name in QUICK if asked.quick else OBJECTS:
        body = example_object(name)
        grasps = gc.plan(body, FRICTION, limit=GRASPS).grasps
        counts["grasps planned"] += len(grasps)
        for kind, new in changed_parts(body, grasps):
            start = time.process_time()
            found = gc.transfer(body, new, grasps, FRICTION, angle_deg=ANGLE_DEG)
            took += time.process_time() - start
            counts[f"parts with a {kind}"] += 1
            counts["transfers"] += len(grasps)
            counts.update(each.status for each in found.grasps)
            contacts_are_where_they_should_be(found, counts)
            judged_as_by_hand(found, counts)
            judged_as_by_hand(gc.transfer(body, new, grasps, LITTLE), counts)
            simulated_as_by_hand(found, counts)
        print(f"{name}: {dict(counts)} ({time.perf_counter() - begun:.0f} s)", flush=True)
    assert counts["contacts without a like face"] > 0
    assert counts["open by hand"] > 0
    assert asked.quick or counts["grasps planned"] >= FEWEST_GRASPS
    print(f"{1e3 * took / counts['transfers']:.1f} ms of processor time for each transfer")


def changed_parts(body, grasps):
    """The part changed in many ways, each with its name; what cannot be made is left out."""
    rng = np.random.default_rng(len(body.faces))
    grasp = grasps[0]
    for finger, by in enumerate(MOVES_MM):
        with contextlib.suppress(AssertionError, gc.MeshError):
            yield "face moved", with_face_moved(body, grasp.faces[finger % 4], 1e-3 * by)
    for finger, radius in enumerate(HOLES_MM):
        for beside in (0.0, 1.4):
            normal = grasp.normals[finger]
            across = np.cross(normal, rng.normal(size=3))
            at = grasp.positions[finger] + 1e-3 * radius * (
                (beside + 0.1) * across / np.linalg.norm(across)
            )
            with contextlib.suppress(gc.MeshError):
                yield "hole", with_hole(body, grasp.faces[finger], at, 1e-3 * radius, 4e-3)
    for width in CHAMFERS_MM:
        for other in range(len(body.faces)):
            with contextlib.suppress(AssertionError, gc.MeshError):
                yield "chamfer", with_chamfer(body, grasp.faces[0], other, 1e-3 * width)
                break


def contacts_are_where_they_should_be(found, counts):
    """Every contact on the new surface with its normal, or no like triangle near enough."""
    slack = 2.0 * ROUNDING * found.old.radius
    for each in found.grasps:
        for contact, before in zip(each.contacts, each.old.contacts, strict=True):
            nearest = nearest_like(found.new, before.position, before.normal, ANGLE_DEG)
            counts["contacts"] += 1
            if contact.contact is None:
                assert nearest > found.distance, each
                counts["contacts without a like face"] += 1
                continue
            assert nearest <= found.distance + slack, each
            assert is_on_surface(found.new, contact.contact), each
            moved = float(np.linalg.norm(contact.contact.position - before.position))
            assert abs(moved - nearest) <= slack, each
            counts["contacts that moved"] += moved > slack
        if each.grasp is not None:
            check_on_faces(found.new, each.grasp)


def judged_as_by_hand(found, counts):
    """The same figures as `graspproof analyze` gives for a contacts file."""
    placed = [each for each in found.grasps if all(c.contact is not None for c in each.contacts)]
    if not placed:
        return
    file = {
        "grasps": [
            {"id": str(place), "contacts": [
                {"position_m": c.contact.position.tolist(), "normal": c.contact.normal.tolist()}
                for c in each.contacts
            ]}
            for place, each in enumerate(placed)
        ],
        "friction": found.friction,
        "center_m": found.new.center_of_mass.tolist(),
        "torque_scale_m": found.new.radius,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as out:
        path = Path(folder) / "contacts.json"
        path.write_text(json.dumps(file))
        graspproof(["analyze", str(path), "--json", "--jobs", "1", "-q"])
    for each, hand in zip(placed, json.loads(out.getvalue())["grasps"], strict=True):
        counts["judged by hand"] += 1
        assert (each.grasp is not None) == hand["closed"], each
        critical = hand["critical_friction"]
        if critical is not None:
            # a grasp's own critical friction is at most the friction that is proved enough
            wanted = min(critical, found.friction) if hand["closed"] else critical
            assert abs(each.after.critical_friction - wanted) <= 1e-7, each
        if hand["closed"]:
            difference = np.subtract(each.after.ferrari_canny, hand["ferrari_canny_l1_n"])
            assert np.abs(difference).max() <= ROUNDING, each
        counts["closed by hand" if hand["closed"] else "open by hand"] += 1


def simulated_as_by_hand(found, counts):
    """The same verdict on a grasp that is made of the contacts alone."""
    if not found.carried:
        return
    grasp = found.carried[0]
    by_hand = grasp_of(seat(found.new, grasp.positions, grasp.normals), FRICTION, grasp.id)
    one, other = (sv.validate(found.new, each, FRICTION) for each in (grasp, by_hand))
    assert one.outcome is other.outcome, grasp
    assert one.controls_let_go == other.controls_let_go, grasp
    simulated = [each.critical_friction.simulated for each in (one, other)]
    assert simulated[0] == simulated[1] or abs(simulated[0] - simulated[1]) <= 1e-6, grasp
    counts["simulated by hand"] += 1
    counts["held in simulation"] += one.held


if __name__ == "__main__":
    main()
