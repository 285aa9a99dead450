"""Published tests against what is proved: `python -m tests.benchmarks.protocols`.

Planned grasps of 15 built-in objects, scaled to a radius of 5 cm, and negative controls made from
them (fingers removed, a normal flipped, contacts moved) are
judged by every published test with four fingertips that push with up to 10 N. The truth is
predicted: a grasp is in force closure at friction 0.5 and resists all loads of the test, by at
least one multiple; a control is proved not to be in force closure at a friction of 0.5 or less.
Controls whose only fault is low friction are left out, because each test has a friction of its own.

Printed are, for each test, how many grasps pass and how many controls, beside our trials of the
same loads; then the same for each kind of control, with the friction of each test as published and,
with `--same-friction`, with 0.5 and hard fingertips in its place.

Ends with an error if our trials do not hold a grasp that is predicted to hold.

    python -m tests.benchmarks.protocols [--quick] [--same-friction] [--jobs N] [--only NAME ..]
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import grasp_core as gc
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from sim_validate.parallel.processes import available_cores, each
from sim_validate.protocols.judging import judge_by
from sim_validate.protocols.published import PROTOCOLS
from sim_validate.validation.controls import negative_controls
from tests.benchmarks.objects import scaled

OBJECTS = (
    "wedge", "dodecahedron", "l-bracket", "random-8-3", "prism", "screwdriver", "box", "cross",
    "chamfered-box", "octahedron", "hexagonal-pyramid", "random-12-1", "tetrahedron", "icosahedron",
    "random-10-2",
)  # fmt: skip
RADIUS_M, FRICTION = 0.05, 0.5
EACH, QUICK_EACH = 20, 2
CONTROLS, QUICK_CONTROLS = 300, 30
LEFT_OUT = "low_friction"


@dataclass(frozen=True)
class Case:
    """A grasp or a control, and the names of the tests that judge it."""

    kind: str
    body: Polyhedron
    grasp: Grasp | tuple[Contact, ...]
    friction: float
    names: tuple[str, ...]
    same_friction: bool


def judged(case):
    """Name the case's kind, and for each test: whether it passes, ours holds, and it should."""
    found = {}
    for name in case.names:
        test = PROTOCOLS[name]
        if case.same_friction:
            hard = replace(test.physics, torsion_m=0.0)
            test = replace(test, friction=FRICTION, physics=hard)
        one = judge_by(test, case.body, case.grasp, case.friction)
        why = next((run.reason for run in one.runs if not run.passed), "")
        found[name] = (one.theirs, one.ours.held, one.predicted, why)
    return case.kind, found


def cases(options):
    count = QUICK_EACH if options.quick else EACH
    grasps, controls = [], []
    for name in OBJECTS:
        body = scaled(name, RADIUS_M)
        common = (tuple(options.only), options.same_friction)
        own = []
        for grasp in gc.plan(body, FRICTION, limit=count).grasps:
            grasps.append(Case("grasp", body, grasp, FRICTION, *common))
            own += [
                Case(control.name, body, control.contacts, control.friction, *common)
                for control in negative_controls(body, grasp, FRICTION, 0)
                if control.name != LEFT_OUT
            ]
        controls.append(own)
    # of each object in turn
    mixed = [one for one in chain.from_iterable(zip_longest(*controls)) if one is not None]
    return grasps, mixed[: QUICK_CONTROLS if options.quick else CONTROLS]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--same-friction", action="store_true")
    parser.add_argument("--jobs", type=int, default=available_cores())
    parser.add_argument("--only", nargs="+", choices=tuple(PROTOCOLS), default=tuple(PROTOCOLS))
    options = parser.parse_args()
    grasps, controls = cases(options)
    print(f"{len(grasps)} grasps of {len(OBJECTS)} objects, {len(controls)} controls", flush=True)
    begun = time.time()
    results = list(each(judged, [*grasps, *controls], jobs=options.jobs))
    print(f"{time.time() - begun:.0f} s with {options.jobs} processes")
    return 0 if report(results, options.only) else 1


def report(results, names):
    kinds = Counter(kind for kind, _ in results)
    print("\ntest, theirs: grasps passed | controls passed; ours; predicted; agreement with it")
    good = True
    for name in names:
        rows = [(kind, *found[name]) for kind, found in results]
        planned = [row for row in rows if row[0] == "grasp"]
        open_ones = [row for row in rows if row[0] != "grasp"]
        passed, accepted = (sum(row[1] for row in part) for part in (planned, open_ones))
        held, kept = (sum(row[2] for row in part) for part in (planned, open_ones))
        true = sum(row[3] for row in planned)
        right = sum(row[1] == row[3] for row in rows)
        good &= all(row[2] for row in planned if row[3]) and not kept
        print(
            f"  {name:20s} {passed:3d} of {len(planned)} | {accepted:3d} of "
            f"{len(open_ones)}; ours {held} | {kept}; predicted {true} | 0; "
            f"{100.0 * right / len(rows):.1f} %"
        )
    print("\ncontrols passed, by kind")
    for kind, count in sorted(kinds.items()):
        if kind != "grasp":
            told = (f"{name} {sum(f[name][0] for k, f in results if k == kind)}" for name in names)
            print(f"  {kind} ({count}): {', '.join(told)}")
    print("\nwhy grasps failed tests")
    for name in names:
        why = Counter(
            f[name][3].split(",")[0] for k, f in results if k == "grasp" and not f[name][0]
        )
        if why:
            print(f"  {name}: {dict(why.most_common(3))}")
    return good


if __name__ == "__main__":
    sys.exit(main())
