"""Hashes of plans and verdicts on ten objects, to compare two trees of the code.

    python -m tests.benchmarks.fingerprint

Contacts count to nine digits of the object's radius, critical frictions to seven after the point.
Two trees that print the same lines plan the same grasps and reach the same verdicts.
"""

import hashlib
import json

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv

OBJECTS = (
    "tetrahedron", "octahedron", "box", "wedge", "prism", "hexagonal-pyramid", "l-bracket", "mug",
    "random-9-7", "random-14-7",
)  # fmt: skip
FRICTION = 0.5
LIMIT = 20


def planned(body):
    """The grasps of an object, for JSON."""
    return [
        {
            "id": grasp.id,
            "family": grasp.family,
            "faces": list(grasp.faces),
            "contacts": rounded((grasp.positions - body.center_of_mass) / body.radius, 9),
            "friction": rounded(grasp.critical_friction, 7),
            "quality": rounded(grasp.ferrari_canny[0], 3),
        }
        for grasp in gc.plan(body, FRICTION, limit=LIMIT).grasps
    ]


def judged(body):
    """The verdicts on the first three grasps of an object, for JSON."""
    grasps = gc.plan(body, FRICTION, limit=3).grasps
    verdicts = [sv.validate(body, grasp, FRICTION) for grasp in grasps]
    return [
        {
            "outcome": verdict.outcome,
            "trials": [trial.hold.outcome for trial in verdict.wrenches],
            "controls": [control.let_go for control in verdict.controls],
            "friction": rounded(verdict.critical_friction.simulated, 6),
        }
        for verdict in verdicts
    ]


def rounded(values, digits):
    """Numbers without their last digits and without minus zero."""
    if values is None:
        return None
    return (np.round(np.asarray(values, dtype=np.float64), digits) + 0.0).tolist()


def main():
    whole = hashlib.sha256()
    for name in OBJECTS:
        body = scenes.example_object(name)
        text = json.dumps([planned(body), judged(body)], sort_keys=True)
        whole.update(text.encode())
        print(f"{name}: {hashlib.sha256(text.encode()).hexdigest()[:16]}", flush=True)
    print(f"all: {whole.hexdigest()[:16]}")


if __name__ == "__main__":
    main()
