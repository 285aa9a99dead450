"""Every kind of certificate: where genuine ones come from, and what makes one true.

A class with `verify` that is not in `TABLE` fails `test_the_table_is_complete`.
"""

import dataclasses
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.execution.carried_mass import CarryingHand, carried_mass
from grasp_core.families.absence_certificate import Absence
from grasp_core.families.free import place_free
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.quality.measures import Measure, resisted_loads
from grasp_core.regions.certify_regions import certify_regions
from sim_validate.planning.regions import ARRAYS, proof_arrays, regions_of
from tests.judges import random_contacts
from tests.tampering import (
    best_grasps,
    exact_closure,
    hand_payloads,
    on_planes,
    placements,
    squeezes,
    wrench_bounds,
)

SIZES = (1e-3, 0.1, 1.0, 100.0)
FRICTIONS = (0.0, 0.05, 0.3, 0.5, 1.0, 3.0)
PLANNED = (("wedge", 0.5), ("tetrahedron", 0.3), ("box", 0.5), ("octahedron", 0.7))


@dataclasses.dataclass(frozen=True)
class Row:
    """One kind of certificate."""

    make: Callable[[int], Any]
    """A genuine certificate, or None, for a seed."""
    true: Callable[[Any, np.random.Generator], bool]
    """Whether it is true by definition."""
    weight: float = 1.0
    """How often it is tried, relative to the others: less where a check takes long."""


def placed(rng):
    """Contacts of some size and place, with frictions, and without torsion."""
    count = int(rng.integers(2, 8))
    x, n = random_contacts(rng, count, rng.choice([0.3, 0.7, 2.0]))
    same = rng.uniform() < 0.6
    mu = rng.choice(FRICTIONS) if same else rng.choice(FRICTIONS, size=count)
    return rng.choice(SIZES) * (x + rng.choice([0.0, 3.0]) * rng.normal(size=3)), n, mu, 0.0


def soft(rng):
    """Contacts of which some have torsion, with frictions above zero where they have."""
    x, n, mu, _ = placed(rng)
    mu = np.full(len(x), mu) if np.ndim(mu) == 0 else mu
    size = float(np.ptp(x, axis=0).max())
    mu_t = size * rng.choice([0.0, 0.01, 0.1, 0.5], size=len(x))
    mu_t[int(rng.integers(len(x)))] = 0.1 * size
    return x, n, np.where(mu_t > 0.0, np.maximum(mu, 0.05), mu), mu_t


def closure(seed, contacts=placed):
    x, n, mu, mu_t = contacts(np.random.default_rng(seed))
    try:
        return gc.force_closure(x, n, mu, torsion_m=mu_t)
    except gc.UndecidedError:
        return None


def friction_interval(seed):
    x, n, _, _ = placed(np.random.default_rng(seed))
    return gc.critical_friction_interval(x, n)


@cache
def planned(seed):
    name, friction = PLANNED[seed % len(PLANNED)]
    body = scenes.example_object(name)
    return body, friction, gc.plan(body, friction, limit=8).grasps


@cache
def pieces_of(name):
    return unit_pieces(scenes.example_object(name))


def absence(seed):
    """Some have several parts, of which each has its proof."""
    rng = np.random.default_rng(seed)
    pieces = pieces_of(PLANNED[seed % len(PLANNED)][0])
    chosen = [pieces[i] for i in rng.choice(len(pieces), 4, replace=False)]
    found = place_free(chosen, rng.choice(FRICTIONS[1:4]), rng=rng, cells=12, restarts=0)
    return found if isinstance(found, Absence) else None


def quality(seed, contacts=placed):
    rng = np.random.default_rng(seed)
    x, n, mu, mu_t = contacts(rng)
    size = float(np.ptp(x, axis=0).max())
    return gc.ferrari_canny(
        x, n, mu, center=x.mean(axis=0), torque_scale=size, norm=rng.choice(["l1", "linf"]).item(),
        gap=0.1, torsion_m=mu_t,
    )  # fmt: skip


def resisted(seed):
    """The weight, or a task, on contacts that are not closed where chance will have it."""
    rng = np.random.default_rng(seed)
    x, n, mu, _ = placed(rng)
    size = float(np.ptp(x, axis=0).max())
    wrenches = WrenchSet.of(x, n, mu, center=x.mean(axis=0), torque_scale=size)
    task = Measure("task", rng.normal(size=(3, 6)))
    return resisted_loads(wrenches, Measure("weight") if seed % 2 else task, 0.1)


def ceiling(seed):
    body, friction, grasps = planned(seed)
    faces = tuple(int(f) for f in np.random.default_rng(seed).choice(len(body.faces), 4))
    faces = faces if seed % 2 and len(set(faces)) == 4 else grasps[seed % len(grasps)].faces
    return gc.quality_ceiling(body, faces, friction, parts=2000)


@cache
def regions(seed):
    body, friction, grasps = planned(seed)
    return certify_regions(
        body, grasps[seed // len(PLANNED) % len(grasps)], friction, max_cones=200,
        recenter=seed % 3 == 1, clearance=0.02 * body.radius * (seed % 2),
    )  # fmt: skip


@cache
def placement(seed):
    """Small and large errors, of the object, the fingers and the friction."""
    body, friction, grasps = planned(seed)
    rng = np.random.default_rng(seed)
    return gc.placement_probability(
        body, grasps[seed // len(PLANNED) % len(grasps)], (friction, 0.05 * rng.integers(2)),
        pose_sigma_m=rng.choice([0.0, 1e-3, 3e-3]), pose_sigma_rad=rng.choice([0.01, 0.05]),
        contact_sigma_m=5e-4 * rng.integers(2),
    )  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class Covered:
    """A cover with what it is to prove."""

    cover: Any
    regions: Any
    normals: Any
    friction: Any

    def verify(self):
        return self.cover.verify(self.regions, self.normals, self.friction)


def cover(seed):
    found = regions(seed)
    if found is None:
        return None
    corners = [
        (np.vstack([r.polygon - d * n, r.polygon + d * n]) - found.origin) / found.scale
        for r, n, d in zip(found.regions, found.normals, found.depths, strict=True)
    ]
    return Covered(found.cover, tuple(corners), found.normals, found.friction)


@dataclasses.dataclass(frozen=True, eq=False)
class Limited:
    """A limit with the contacts that it is about."""

    found: Any
    positions: Any
    normals: Any
    friction: Any
    max_normal_force: Any
    center: Any
    motors: Any
    torsion_m: Any = 0.0

    def verify(self):
        return self.found.verify(
            self.positions, self.normals, self.friction, max_normal_force=self.max_normal_force,
            center=self.center, motors=self.motors, torsion_m=self.torsion_m,
        )  # fmt: skip


def wrench_limit(seed, contacts=placed):
    """With motors, every other one that has no torsion."""
    rng = np.random.default_rng(seed)
    x, n, mu, mu_t = contacts(rng)
    size, largest = float(np.ptp(x, axis=0).max()), float(10.0 ** rng.uniform(-1, 2))
    center = x.mean(axis=0) + size * rng.normal(size=3)
    load = rng.normal(size=6) * np.repeat([1.0, size], 3)
    given = {
        "max_normal_force": largest,
        "center": center,
        "motors": motors(rng, len(x), largest) if seed % 2 and not np.any(mu_t) else None,
    }
    (found,) = gc.wrench_limits(x, n, mu, load[None], torsion_m=mu_t, **given)
    return Limited(found, x, n, mu, largest, center, given["motors"], mu_t)


def motors(rng, count, largest):
    """Motors of two joints for each of `count` contacts, whose limits count."""
    levers = rng.normal(size=(2 * count, 3 * count))
    levers *= np.kron(np.eye(count), np.ones((2, 3)))
    limits = largest * rng.uniform(0.2, 2.0, size=2 * count)
    return gc.Motors(levers, limits, rng.uniform(-0.5, 0.5) * limits)


@cache
def held(seed):
    """Keyword arguments of a grip."""
    rng = np.random.default_rng(seed)
    body, friction, grasps = planned(seed)
    return (body, grasps[seed // len(PLANNED) % len(grasps)], friction), {
        "stiffness": float(rng.choice([1000.0, 5000.0])),
        "tip_radius_m": float(rng.choice([0.0, 0.01])),
    }


def best_squeeze(seed):
    """With and without a limit on pushes, an offset, and motors."""
    rng = np.random.default_rng(seed)
    contacts, springs = held(seed)
    size = contacts[0].radius
    axes = np.diag(np.repeat([0.5, 0.5 * size], 3))[:, : rng.choice([3, 6])]
    loads = gc.LoadSet([0.0, 0.0, -1.0 * (seed % 2), 0.0, 0.0, 0.0], axes)
    given = {
        "max_push_n": None if seed % 3 == 1 else 10.0,
        "motors": motors(rng, 4, 10.0) if seed // 2 % 2 else None,  # with offsets, and without
    }
    try:
        return gc.best_squeeze(*contacts, loads, **given, **springs)
    except gc.NoForcesError:
        return None


def payload(seed):
    contacts, springs = held(seed)
    hand = None
    if seed % 2:
        hand = motors(np.random.default_rng(seed), 4, 10.0)
        hand = gc.Motors.of(hand.levers, hand.limits)
    return gc.payload(*contacts, max_push_n=10.0, motors=hand, **springs)


def hand_payload(seed):
    rng = np.random.default_rng(seed)
    body, friction, grasps = planned(seed)
    grasp = grasps[seed // len(PLANNED) % len(grasps)]
    joints = motors(rng, 4, 10.0)
    pulls = rng.normal(size=(len(joints.limits), 3))
    pulls *= (0.5 * joints.limits / np.linalg.norm(pulls, axis=1))[:, None]
    hand = CarryingHand(
        grasp.positions - body.center_of_mass, grasp.normals, np.full(4, friction), 10.0,
        gc.Motors.of(joints.levers, joints.limits), pulls,
    )  # fmt: skip
    return carried_mass(hand)


@cache
def best(seed):
    name, friction = (("tetrahedron", 0.5), ("random-4-1", 0.5), ("tetrahedron", 0.8))[seed % 3]
    return gc.best_grasp(scenes.example_object(name), friction, gap=0.35)


@cache
def best_for_loads(seed):
    body = scenes.example_object("tetrahedron")
    if seed % 2:
        return gc.best_grasp(body, 0.5, gap=0.06, measure="weight")
    axes = np.vstack([np.eye(6), -np.eye(6)]) * np.repeat([1.0, 0.05], 3)
    return gc.best_grasp(body, 0.5, gap=0.3, measure="task", wrenches=axes)


ProofFile = dataclasses.make_dataclass(
    "ProofFile", ARRAYS, frozen=True, eq=False,
    namespace={"verify": lambda self: regions_of(vars(self)).verify()},
)  # fmt: skip
"""The arrays of a proof in a folder that `graspproof regions` writes."""


def proof_file(seed):
    found = regions(seed)
    if found is None:
        return None
    body, _, grasps = planned(seed)
    arrays = proof_arrays(found, grasps[0], body)
    return ProofFile(**{name: np.asarray(arrays[name]) for name in ARRAYS})


TABLE = {
    "ClosureCertificate": Row(closure, lambda c, _: exact_closure.closure(c), 3.0),
    "FrictionInterval": Row(friction_interval, lambda c, _: exact_closure.interval(c), 0.6),
    "Absence": Row(absence, on_planes.absence, 0.6),
    "FerrariCanny": Row(quality, wrench_bounds.quality),
    "QualityCeiling": Row(ceiling, best_grasps.ceiling, 0.7),
    "CertifiedRegions": Row(regions, on_planes.regions, 0.4),
    "TwistCover": Row(
        cover, lambda c, rng: on_planes.all_closed(c.regions, c.normals, c.friction, rng), 0.5
    ),
    "PlacementProbability": Row(placement, placements.placement, 0.7),
    "WrenchLimit": Row(wrench_limit, lambda c, _: wrench_bounds.wrench_limit(c)),
    "a closure certificate with torsion": Row(
        partial(closure, contacts=soft), lambda c, _: exact_closure.closure(c), 2.0
    ),
    "a quality with torsion": Row(partial(quality, contacts=soft), wrench_bounds.quality),
    "a wrench limit with torsion": Row(
        partial(wrench_limit, contacts=soft), lambda c, _: wrench_bounds.wrench_limit(c)
    ),
    "BestSqueeze": Row(best_squeeze, lambda c, _: squeezes.squeeze(c), 0.8),
    "CutTree": Row(lambda seed: best(seed).proof, best_grasps.proof, 0.8),
    "BestGrasp": Row(best, best_grasps.best, 0.4),
    "a cut tree for other loads": Row(
        lambda seed: best_for_loads(seed).proof, best_grasps.proof, 0.4
    ),
    "a best grasp for a task": Row(lambda _: best_for_loads(0), best_grasps.best, 0.4),
    "ResistedLoads": Row(resisted, wrench_bounds.resisted),
    "Payload": Row(payload, lambda c, _: hand_payloads.payload_of_contacts(c), 0.4),
    "HandPayload": Row(hand_payload, lambda c, _: hand_payloads.payload(c), 0.8),
    "proof file of regions": Row(
        proof_file, lambda c, rng: on_planes.regions(regions_of(vars(c)), rng), 0.4
    ),
}
INTERFACES = {"Proof"}
"""Classes with `verify` that certify nothing themselves."""
