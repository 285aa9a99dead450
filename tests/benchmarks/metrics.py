"""Metrics of one grasp beside qhull, scipy's linear programs and a bisection with Clarabel.

Every contender first has to agree on every grasp (see the asserts); then all take turns on the
same grasps. Ratios are to the first row of each group, which is this project's.
"""

import math

import clarabel
import numpy as np
from scipy import sparse
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

import grasp_core as gc
from scenes.example_objects import example_object
from tests.benchmarks.timing import compared
from tests.judges import pyramid_wrenches

FRICTIONS = (math.tan(math.radians(10.0)), 0.5)
OBJECTS = ("wedge", "random-20-7", "random-14-1")
GRASPS = 8
"""Of each object at each friction, at most."""
SURE = 0.9
"""Largest critical friction, in shares of the one that there is."""
ROUNDS = 7
BISECTIONS = 30
WRENCHES = 24
MAX_FORCE = 1.0


class Case:
    """One grasp, its contacts about their mean point and at unit size, with wrenches to resist."""

    def __init__(self, grasp, friction, rng):
        arms = grasp.positions - grasp.positions.mean(axis=0)
        self.x = arms / np.linalg.norm(arms, axis=1).max()
        self.n, self.mu = grasp.normals, friction
        self.wrenches = rng.normal(size=(WRENCHES, 6))
        self.limit = self.wrenches[0]
        capacity = [
            gc.max_resisted_wrench(self.x, self.n, self.mu, w, max_normal_force=MAX_FORCE)
            for w in self.wrenches
        ]
        self.loads = 0.5 * np.array(capacity)[:, None] * self.wrenches


def cases():
    """Grasps of several objects that friction holds with some room to spare."""
    rng = np.random.default_rng(0)
    found = []
    for name in OBJECTS:
        body = example_object(name)
        for friction in FRICTIONS:
            grasps = gc.plan(body, friction, limit=2 * GRASPS).grasps
            sure = [g for g in grasps if g.critical_friction < SURE * friction]
            found += [Case(grasp, friction, rng) for grasp in sure[:GRASPS]]
    assert len(found) >= GRASPS * len(OBJECTS)
    return found


def qhull(case, edges):
    W = pyramid_wrenches(case.x, case.n, case.mu, edges, outer=False)
    return -ConvexHull(W, qhull_options="QJ Pp").equations[:, -1].max()


def clarabel_critical(case):
    """The friction at which the margin of the cone program changes sign, by bisection."""
    low, high = 0.0, 2.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if clarabel_margin(case, middle) > 0.0 else (middle, high)
    return high


def clarabel_margin(case, friction):
    rows, sides, share = np.zeros((6, 13)), [], np.zeros(13)
    for i, (arm, normal) in enumerate(zip(case.x, case.n, strict=True)):
        tangents = np.linalg.svd(normal[None])[2][1:]
        for j, force in enumerate((normal, *tangents)):
            rows[:, 3 * i + j] = [*force, *np.cross(arm, force)]
        cone = np.zeros((3, 13))
        cone[0, 3 * i], cone[0, 12] = -friction, 1.0
        cone[1, 3 * i + 1] = cone[2, 3 * i + 2] = -1.0
        share[3 * i] = 1.0
        sides.append(cone)
    A = np.vstack([rows, share, *sides])
    b, q = np.zeros(len(A)), np.zeros(13)
    b[6], q[12] = 1.0, -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    kinds = [clarabel.ZeroConeT(7), *[clarabel.SecondOrderConeT(3)] * 4]
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((13, 13)), q, sparse.csc_matrix(A), b, kinds, settings
    )
    return solver.solve().x[12]


def linprog_limit(case, edges, *, outer):
    """Largest multiple of a wrench that pyramids resist."""
    W = pyramid_wrenches(case.x, case.n, case.mu, edges, outer=outer)
    count = len(W)
    caps = np.kron(np.eye(4), np.ones(edges))
    answer = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.hstack([caps, np.zeros((4, 1))]), b_ub=np.full(4, MAX_FORCE),
        A_eq=np.hstack([W.T, case.limit[:, None]]), b_eq=np.zeros(6), method="highs",
    )  # fmt: skip
    return -answer.fun


def linprog_min_weight(case, edges):
    W = pyramid_wrenches(case.x, case.n, case.mu, edges, outer=False)
    count = len(W)
    equalities = np.vstack([np.hstack([W.T, np.zeros((6, 1))]), np.append(np.ones(count), 0.0)])
    return -linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]), b_ub=np.zeros(count),
        A_eq=equalities, b_eq=np.append(np.zeros(6), 1.0),
        bounds=[(None, None)] * (count + 1), method="highs",
    ).fun  # fmt: skip


def quality(case, norm):
    return gc.ferrari_canny(case.x, case.n, case.mu, torque_scale=1.0, norm=norm)


def forces(case, loads, objective="least_norm"):
    return gc.contact_forces(
        case.x, case.n, case.mu, loads, objective=objective, normal_force=(0.0, MAX_FORCE)
    )


def limit(case):
    return gc.max_resisted_wrench(case.x, case.n, case.mu, case.limit, max_normal_force=MAX_FORCE)


GROUPS = {
    "Ferrari-Canny l1": {
        "ferrari_canny l1, gap 1e-4": lambda c: quality(c, "l1"),
        "qhull, 8 edges": lambda c: qhull(c, 8),
        "qhull, 16 edges": lambda c: qhull(c, 16),
    },
    "Ferrari-Canny linf": {"ferrari_canny linf, gap 1e-4": lambda c: quality(c, "linf")},
    "force closure": {"force_closure": lambda c: gc.force_closure(c.x, c.n, c.mu).margin},
    "critical friction": {
        "critical_friction": lambda c: gc.critical_friction(c.x, c.n),
        f"Clarabel, {BISECTIONS} bisections": clarabel_critical,
    },
    "largest wrench": {
        "max_resisted_wrench": limit,
        "scipy.linprog, 16 edges": lambda c: linprog_limit(c, 16, outer=False),
    },
    "min-weight": {
        "min_weight, 8 edges": lambda c: gc.min_weight(c.x, c.n, c.mu),
        "scipy.linprog, 8 edges": lambda c: linprog_min_weight(c, 8),
    },
    "forces": {
        "contact_forces least_norm, one wrench": lambda c: forces(c, c.loads[0]),
        f"contact_forces least_norm, batch of {WRENCHES}": lambda c: forces(c, c.loads),
        "contact_forces least_friction, one wrench": lambda c: forces(
            c, c.loads[0], "least_friction"
        ),
    },
}
BATCHES = {
    "critical friction": ("critical_frictions, all at once", lambda every: gc.critical_frictions(
        np.array([c.x for c in every]), np.array([c.n for c in every])
    )),
}  # fmt: skip
"""A first contender of some groups, which gets all cases together."""
PER_WRENCH = {f"contact_forces least_norm, batch of {WRENCHES}": WRENCHES}


def accuracy(found):
    """What the contenders must agree on, and how far they are apart: said once per contender.

    Args:
        found: Answers of every contender, a list over the cases each.
    """
    said = dict.fromkeys(found, "")
    ours = found["ferrari_canny l1, gap 1e-4"]
    gaps = [(q.upper - q.lower) / q.upper for q in ours]
    said["ferrari_canny l1, gap 1e-4"] = f"gap <= {max(gaps):.1e}"
    for edges in (8, 16):
        low = np.array([1.0 - max(v, 0.0) / q.lower for v, q in
                        zip(found[f"qhull, {edges} edges"], ours, strict=True)])  # fmt: skip
        assert low.min() > -1e-4
        said[f"qhull, {edges} edges"] = f"{np.median(low):.1%} low, worst {low.max():.0%}"
    wide = [(q.upper - q.lower) / q.upper for q in found["ferrari_canny linf, gap 1e-4"]]
    said["ferrari_canny linf, gap 1e-4"] = f"gap <= {max(wide):.1e}"
    exact = np.array(found["critical_friction"])
    other = np.array(found[f"Clarabel, {BISECTIONS} bisections"])
    apart = np.abs(exact - other).max()
    assert apart < 1e-6
    said[f"Clarabel, {BISECTIONS} bisections"] = f"<= {apart:.0e} apart"
    low = 1.0 - np.array(found["scipy.linprog, 16 edges"]) / np.array(found["max_resisted_wrench"])
    assert low.min() > -1e-6
    said["scipy.linprog, 16 edges"] = f"{np.median(low):.1%} low, worst {low.max():.1%}"
    return said


def rows():
    """One row per contender, after all of them agreed."""
    every = cases()
    contenders = {name: run for group in GROUPS.values() for name, run in group.items()}
    found = {name: [run(case) for case in every] for name, run in contenders.items()}
    said = accuracy(found)
    listed = []
    for name, group in GROUPS.items():
        runs = {what: counted(run, PER_WRENCH.get(what, 1)) for what, run in group.items()}
        if name in BATCHES:
            what, batch = BATCHES[name]
            alone = np.array(found[next(iter(group))])
            np.testing.assert_allclose(batch(every), alone, rtol=1e-6)
            runs = {what: lambda block, batch=batch: len(batch(block))} | runs
        listed += compared("metrics", runs, [every] * ROUNDS, said)
    return listed


def counted(run, share):
    """Answer every case of a block; each counts as many."""
    return lambda block: share * len([run(case) for case in block])
