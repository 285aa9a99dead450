"""What hands hold with their motors, predicted against simulated.

    python -m tests.benchmarks.hand_limits [--grasps 100] [--payloads 8] [--quick]

Grasps of five built-in objects, two of them not convex, that the Allegro and the LEAP hand reach,
with motors of 0.35 and 0.15 N m. For each, the limits of 26 wrenches are found by slowly rising
loads; the hand must hold 0.9 of each predicted limit and let go at 1.1 of it; its negative controls
must let go. The LEAP hand, whose links have masses, then carries a weight under gravity in 42
directions of space and in its weakest one: the largest mass of each, predicted and simulated, and
that of any orientation.
"""

import argparse
import time
from collections import Counter
from itertools import combinations

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from sim_validate.engine.rig import Analysis, closed_on, part, ramped_limits
from sim_validate.engine.traces import holds
from tests.benchmarks.objects import scaled

FRICTION, RADIUS_M, APPROACH_M = 0.5, 0.035, 0.03
OBJECTS = ("dodecahedron", "wedge", "l-bracket", "hex-nut", "box")
HANDS = ("allegro", "leap")
TORQUES = (0.35, 0.15)
BELOW, ABOVE = 0.9, 1.1
LOOSE, HOPEFUL = 0.98, 1.01
"""Least and largest share of the least simulated mass that a hand may be promised to carry."""
AGENDA = sv.Agenda(random_wrenches=13, limits="ramp", critical_friction=False)


def reached(hand, body, count):
    """Yield the poses in which a hand reaches the best grasps."""
    finger = gc.Finger(hand.fingers[0].tip.radius, APPROACH_M)
    for grasp in gc.plan(body, FRICTION, limit=count, finger=finger).grasps:
        found = gc.reach_with(hand, body, grasp, FRICTION)
        if found.reached:
            yield found


def rig_of(scene, setup):
    """The hand, closed on the object."""
    return closed_on(scene, setup, scene.layout.friction)


def around(body, contacts, verdict):
    """False answers just below and above the limits, of how many, as counts."""
    setup, layout = verdict.setup, verdict.scene.layout
    rig, counted = rig_of(verdict.scene, setup), Counter()
    planned = Analysis(body, contacts, FRICTION, setup, verdict.scene.hand.motors).planned(
        rig.idle, AGENDA
    )
    limits = [each.limit for each in planned]
    for share, right in ((BELOW, True), (ABOVE, False)):
        traces = rig.hold([part(rig.idle, limit, share) for limit in limits])
        answers = [holds(trace, layout, setup.hold) for trace in traces]
        counted["answers"] += len(answers)
        counted["false"] += sum(answer is not None and answer != right for answer in answers)
        counted["open"] += sum(answer is None for answer in answers)
    return counted


def limits(count):
    """Print errors of limits, false answers and controls that held; return what is wrong."""
    shares, counted, seconds, kinds = [], Counter(), [], Counter()
    each = -(-count // (len(HANDS) * len(OBJECTS)))
    for name in HANDS:
        hand = gc.load_hand(name)
        for body in (scaled(name, RADIUS_M) for name in OBJECTS):
            for found in reached(hand, body, each):
                for torque in TORQUES:
                    strong = hand.with_torque_limits(torque, "this benchmark")
                    begun = time.process_time()
                    verdict = sv.validate_hand(strong, body, found, FRICTION, agenda=AGENDA)
                    seconds.append(time.process_time() - begun)
                    at = [trial.let_go_at for trial in verdict.wrenches]
                    shares += [one.share for one in at if one is not None]
                    counted["limits not found"] += sum(one is None for one in at)
                    counted["not held at .8"] += len(verdict.failures)
                    counted += around(body, found.contacts, verdict)
                    for control in verdict.controls:
                        kinds[control.control.name] += 1
                        counted["controls held"] += not control.let_go
                counted["grasps"] += 1
            print(name, body.name, dict(counted), flush=True)
    errors = np.abs(np.array(shares) - 1.0)
    print(
        f"{counted['grasps']} grasps x {len(TORQUES)} torque limits, {len(shares)} limits: "
        f"simulated over predicted {min(shares):.4f} to {max(shares):.4f}, error median "
        f"{100 * np.median(errors):.3f} %, 95 % within {100 * np.quantile(errors, 0.95):.3f} %"
    )
    print(
        f"{counted['answers']} holds at {BELOW:g} and {ABOVE:g} of the limit: {counted['false']} "
        f"false, {counted['open']} open; controls {dict(kinds)}: {counted['controls held']} held; "
        f"{np.median(seconds):.2f} s a verdict"
    )
    wrong = ("false", "controls held", "limits not found", "not held at .8")
    return sum(counted[name] for name in wrong)


def payloads(count):
    """Print errors of the largest mass in each direction, and of those in any orientation."""
    hand, setup = gc.load_hand("leap").with_torque_limits(0.35, "this benchmark"), sv.hand_setup()
    body, most = scaled("dodecahedron", RADIUS_M), setup.fingers.max_normal_force_n
    ratios, least, spread, lowered, seconds = [], [], [], [], []
    for found in reached(hand, body, count):
        begun = time.process_time()
        promised = gc.hand_payload(hand, body, found, FRICTION, max_push_n=most)
        seconds.append(time.process_time() - begun)
        every = gc.hand_motors(hand, found, any_orientation=True)
        safe = gc.payload(body, found.contacts, FRICTION, max_push_n=most, motors=every).free.lower
        masses = []
        for way in (*directions(), promised.weakest):
            share, mass = carried(hand, body, found, way, setup)
            ratios.append(share)
            masses.append(mass)
        least.append(promised.lower / min(masses))
        spread.append(promised.lower / min(masses[:-1]))
        lowered.append(safe / min(masses))
    print(
        f"{len(least)} grasps x {len(ratios) // max(len(least), 1)} directions: simulated over "
        f"predicted mass {np.nanmin(ratios):.4f} to {np.nanmax(ratios):.4f}, "
        f"{int(np.isnan(ratios).sum())} not found"
    )
    print(
        f"hand_payload, {np.median(seconds):.3f} s each, over the least simulated mass: "
        f"{min(least):.4f} to {max(least):.4f}; without the weakest direction "
        f"{min(spread):.4f} to {max(spread):.4f}; payload with lowered limits over the least "
        f"{min(lowered):.4f} to {max(lowered):.4f}"
    )
    wrong = [not LOOSE <= share <= HOPEFUL for share in least]
    return int(np.isnan(ratios).sum()) + sum(wrong)


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
    rig = rig_of(scene, setup)
    weight = [("weight", np.append(GRAVITY_M_PER_S2 * way, np.zeros(3)))]
    analysis = Analysis(body, found.contacts, FRICTION, setup, scene.hand.motors)
    (load,) = analysis.as_they_are(rig.idle, weight)
    (at,) = ramped_limits(rig, [load.limit])
    share = np.nan if at is None else at.share
    return share, load.predicted_limit * share


def main():
    """Print the figures; 1 if an answer is false or a control holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=100)
    parser.add_argument("--payloads", type=int, default=8)
    parser.add_argument("--quick", action="store_true", help="10 grasps, 1 payload")
    asked = parser.parse_args()
    grasps, carried = (10, 1) if asked.quick else (asked.grasps, asked.payloads)
    return int(bool(limits(grasps) + payloads(carried)))


if __name__ == "__main__":
    raise SystemExit(main())
