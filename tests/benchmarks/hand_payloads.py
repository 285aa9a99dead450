"""What a hand holds in any orientation with its motors, predicted against simulated.

    python -m tests.benchmarks.hand_payloads [--grasps 8]

The LEAP hand, whose links have masses, carries a weight in grasps of a dodecahedron, under gravity
in 42 directions of space and in its weakest one: the largest mass of each, predicted and simulated,
and that of any orientation.
"""

import argparse
from itertools import combinations

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from sim_validate.engine.planned_loads import LoadPlanner
from sim_validate.engine.rig import closed_on
from sim_validate.engine.simulated_limits import ramped_limits

FRICTION, RADIUS_M, APPROACH_M = 0.5, 0.035, 0.03
LOOSE, HOPEFUL = 0.98, 1.01
"""Least and largest share of the least simulated mass that a hand may be promised to carry."""


def reached(hand, body, count):
    """Yield the poses in which a hand reaches the best grasps."""
    finger = gc.Finger(hand.fingers[0].tip.radius, APPROACH_M)
    for grasp in gc.plan(body, FRICTION, limit=count, finger=finger).grasps:
        found = gc.reach_with(hand, body, grasp, FRICTION)
        if found.reached:
            yield found


def main():
    """Print the figures; 1 if a mass is not found, or promised by more than is simulated."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=8)
    hand, setup = gc.load_hand("leap").with_torque_limits(0.35, "this benchmark"), sv.hand_setup()
    solid, most = scenes.example_object("dodecahedron"), setup.fingers.max_normal_force_n
    vertices = (solid.vertices - solid.center_of_mass) * RADIUS_M / solid.radius
    body = gc.Polyhedron.from_mesh(vertices, solid.triangles, name=solid.name)
    ratios, least = [], []
    for found in reached(hand, body, parser.parse_args().grasps):
        promised = gc.hand_payload(hand, body, found, FRICTION, max_push_n=most)
        ways = (*directions(), promised.weakest)
        shares, masses = zip(*(carried(hand, body, found, way, setup) for way in ways), strict=True)
        ratios += shares
        least.append(promised.lower / min(masses))
    print(
        f"{len(least)} grasps, {len(ratios)} directions: simulated over predicted mass "
        f"{min(ratios):.4f} to {max(ratios):.4f}; promised in any orientation over the least "
        f"simulated mass {min(least):.4f} to {max(least):.4f}"
    )
    return int(not all(LOOSE <= share <= HOPEFUL for share in least))


def directions():
    """The corners and the middles of the edges of an icosahedron, (42, 3)."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    flat = np.array([[0.0, s, t * golden] for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(flat, turn, axis=1) for turn in range(3)])
    edges = [a + b for a, b in combinations(corners, 2) if np.linalg.norm(a - b) < 2.1]
    ways = np.concatenate([corners, edges])
    return ways / np.linalg.norm(ways, axis=1)[:, None]


def carried(hand, body, found, way, setup):
    """The simulated largest mass under gravity along a direction: over the predicted one, [kg]."""
    scene = scenes.build_hand_scene(hand, body, found, FRICTION, down=tuple(way))
    rig = closed_on(scene, setup, scene.layout.friction)
    weight = [("weight", np.append(GRAVITY_M_PER_S2 * way, np.zeros(3)))]
    analysis = LoadPlanner(body, found.contacts, FRICTION, setup, scene.hand.motors)
    (load,) = analysis.as_they_are(rig.idle, weight)
    (at,) = ramped_limits(rig, [load.limit])
    assert at is not None
    return at.share, load.predicted_limit * at.share


if __name__ == "__main__":
    raise SystemExit(main())
