"""False absences, covers and regions.

What is claimed to be closed holds a choice that is open, or the other way round: shown in rational
arithmetic, by conic programs far from their tolerance, or by lengths and areas.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial import ConvexHull

import grasp_core as gc
from grasp_core.families.absence_certificate import Absence
from grasp_core.geometry import polygons as flat_polygons
from grasp_core.optimizing.better_contacts import pieces_under
from grasp_core.regions import regions_certificate as covers
from grasp_core.regions.regions_certificate import CertifiedRegions
from tests.attacks.searching import Attack, always, power
from tests.grasp_core.exact_judges import open_exactly
from tests.tampering import on_planes, table
from tests.tampering.exact_closure import closed, tangents

SEEDS = 4


@cache
def genuine(seed):
    """Genuine regions, their cover, and a friction at which a choice of contacts is open."""
    while True:
        r = table.regions(seed)
        if r is not None:
            x = np.array([region.polygon.mean(axis=0) for region in r.regions])
            found = gc.critical_friction_interval(x, r.normals)
            if found.lower > 1e-3 and open_exactly(found.twist, x, r.normals, found.lower):
                return r, table.cover(seed), found.lower
        seed += SEEDS


def any_seed(rng):
    return int(rng.integers(SEEDS))


def flatter(forces, normals, friction, over, rng):
    """Forces moved into smaller cones, or out of them by a share, of any length."""
    along = np.maximum(np.einsum("mki,ki->mk", forces, normals), 0.0)
    across = forces - np.einsum("mki,ki->mk", forces, normals)[..., None] * normals
    length = np.linalg.norm(across, axis=2)
    share = np.minimum(friction * along / np.maximum(length, 1e-300), 1.0) * (1.0 + over)
    f = along[..., None] * normals + share[..., None] * across
    return f * 10.0 ** rng.choice([0.0, 0.0, -300.0, -310.0, 40.0], size=(1, 1, 1))


def cover_at_less_friction(rng):
    r, c, open_at = genuine(any_seed(rng))
    friction = np.full(4, open_at * (1.0 - power(rng, -9, 0)))
    over = power(rng, -17, 0) if rng.uniform() < 0.5 else -1e-9
    forces = flatter(c.cover.forces, r.normals, friction[0], over, rng)
    axes = c.cover.axes * 2.0 ** rng.integers(-49, 50, size=(6, 1))
    axes = axes if rng.uniform() < 0.5 else c.cover.axes
    return lambda: replace(c, friction=friction, cover=replace(c.cover, forces=forces, axes=axes))


def without_slack(monkeypatch):
    """Cones count as filled where powers are less than rounding below zero, and much more."""
    monkeypatch.setattr(covers, "slack_of", lambda F, _: np.full(len(F), -1e9))


COVER = Attack((cover_at_less_friction,), (without_slack,), 600)


def with_scale(r, rng, **changed):
    """Return regions whose unit of length is another, with the axes of their proof scaled alike."""
    s = power(rng, -2, 8.5) if rng.uniform() < 0.8 else 1.0
    axes = r.cover.axes * np.repeat([1.0, s], 3)
    axes = axes / np.linalg.norm(axes, axis=1).max()
    cover = replace(r.cover, axes=axes)
    return replace(r, scale=r.scale * s, cover=cover, **changed)


def smaller(r, rng):
    """Regions that are much smaller, so that their cover has room for any slack."""
    share, middles = rng.uniform(0.05, 0.9), [p.polygon.mean(axis=0) for p in r.regions]
    parts = tuple(
        replace(
            p, polygon=middle + share * (p.polygon - middle),
            inscribed_radius=share * p.inscribed_radius,
        ) for p, middle in zip(r.regions, middles, strict=True)
    )  # fmt: skip
    return replace(
        r, regions=parts, centers=np.array(middles), radius=0.0, open_choice=None, open_wrench=None,
        limit=np.inf,
    )  # fmt: skip


def farther_discs(rng):
    """Discs that the polygons do not hold, and polygons that go around many times."""
    r = smaller(genuine(any_seed(rng))[0], rng)
    far = [
        np.linalg.norm(p.polygon - c, axis=1).min()
        for p, c in zip(r.regions, r.centers, strict=True)
    ]
    wide = replace(r, radius=float(rng.choice([1.05, 1.2, 1.5, 3.0])) * max(far))
    if all(on_planes._disc_is_held(wide, i) for i in range(4)):
        return None
    copies = int(rng.choice([1, 1, 2, 20, 100]))
    parts = tuple(replace(p, polygon=np.tile(p.polygon, (copies, 1))) for p in wide.regions)
    return lambda: with_scale(wide, rng, regions=parts)


def regions_at_less_friction(rng):
    r, _, open_at = genuine(any_seed(rng))
    friction = np.full(4, open_at * (1.0 - power(rng, -9, 0)))
    forces = flatter(r.cover.forces, r.normals, friction[0], -1e-9, rng)
    return lambda: with_scale(
        replace(r, cover=replace(r.cover, forces=forces), friction=friction), rng
    )


def beyond_borders(rng):
    """Borders that a region leaves by a hundred times the slack at least."""
    r = smaller(genuine(any_seed(rng))[0], rng)
    i = int(rng.integers(4))
    polygon, frame = r.regions[i].polygon, tangents(r.normals[i])
    middle = polygon.mean(axis=0)
    border = middle + (polygon - middle) * (1.0 - power(rng, -6, -0.5))
    rows = ConvexHull((border - middle) @ frame).equations
    if ((polygon - middle) @ frame @ rows[:, :2].T + rows[:, 2]).max() < 1e-7 * r.scale:
        return None
    borders = (*r.borders[:i], border, *r.borders[i + 1 :])
    return lambda: with_scale(r, rng, borders=borders)


REGIONS = Attack(
    (farther_discs, regions_at_less_friction, beyond_borders),
    (
        lambda monkeypatch: monkeypatch.setattr(
            CertifiedRegions, "_has_fitting_scale", always(True)
        ),
        lambda monkeypatch: monkeypatch.setattr(flat_polygons, "_turns_once", always(True)),
    ),
    1000,
)


@cache
def absent(seed):
    """A genuine absence in one part."""
    while True:
        a = table.absence(seed)
        if a is not None and len(a.leaves) == 1:
            return a
        seed += 1


@cache
def held(seed):
    """Pieces with four contacts that are closed by far, the contacts, and the friction."""
    body, friction, grasps = table.planned(seed)
    x = (grasps[0].positions - body.center_of_mass) / body.radius
    assert closed(x, grasps[0].normals, np.full(4, friction)) is True
    return tuple(pieces_under(body, grasps[0])), x, friction


def absent_though_held(rng):
    """Proofs of others, proofs of parts only, paths that come twice, at more and less friction."""
    pieces, _, friction = held(any_seed(rng))
    a = absent(int(rng.integers(8)))
    path, proof = a.leaves[0]
    leaves = [
        ((path, proof),), (((0,), proof), ((1,), proof)), (((0,), proof), ((0,), proof)),
        (((True,), proof), ((False,), proof)), (((0,), proof), ((1, 0), proof), ((1, 0), proof)),
    ]  # fmt: skip
    y = proof.separating_wrench * power(rng, -323, 40)
    points = np.vstack([p.origin + p.corners @ p.frame.T for p in pieces])
    normals = np.vstack([np.tile(p.normal, (len(p.corners), 1)) for p in pieces])
    forged = gc.ClosureCertificate(
        False, 0.0, points, normals, np.full(len(points), friction), None, y
    )
    leaves.append((((), forged),))
    chosen = leaves[int(rng.integers(len(leaves)))]
    return lambda: Absence(pieces, friction * rng.uniform(0.99, 1.0), chosen)


ABSENCE = Attack(
    (absent_though_held,),
    (lambda monkeypatch: monkeypatch.setattr(Absence, "_separated", always(True)),),
    1200,
)
