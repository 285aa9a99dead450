"""What is claimed of misplaced objects: contacts are drawn where fingers meet the landings."""

import math

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from grasp_core.closure.contacts import unit_size
from grasp_core.closure.decision import decided_at_once
from grasp_core.closure.proofs import ContactCones
from tests.tampering.exact_closure import tangents
from tests.tampering.on_planes import polygon_in_plane

COUNT = 1500


def placement(it, rng):
    """The grasp is closed at least as often as claimed, but for the luck of `COUNT` draws."""
    sizes = [float(np.ptp(each, axis=0).max()) for each in it.landings]
    flat = [
        polygon_in_plane(landing, n, size) is not None and abs((landing[0] - x) @ n) < 1e-8 * size
        for landing, n, x, size in zip(it.landings, it.normals, it.positions, sizes, strict=True)
    ]
    share = closed_share(it, rng)
    luck = 4.0 * math.sqrt(max(share * (1.0 - share), 1.0 / COUNT) / COUNT)
    return all(flat) and it.lower <= share + luck


def closed_share(it, rng):
    """Share of draws in which fingers meet the moved landings, and contacts there are closed."""
    moves = rng.multivariate_normal(np.zeros(6), it.off.covariance, size=COUNT, method="eigh")
    R = Rotation.from_rotvec(moves[:, 3:]).as_matrix()
    mu = it.off.friction + it.off.friction_sigma * rng.normal(size=COUNT)
    points, normals = np.empty((COUNT, 4, 3)), np.empty((COUNT, 4, 3))
    there = mu > 0.0
    for i, (x, n) in enumerate(zip(it.positions, it.normals, strict=True)):
        u = tangents(n)
        finger = x + it.off.contact_sigma * rng.normal(size=(COUNT, 2)) @ u.T
        turned = R @ n
        plane = np.einsum("nij,j->ni", R, x - it.center) + it.center + moves[:, :3]
        along = np.einsum("ni,ni->n", turned, plane - finger) / (turned @ n)
        along += it.depth * rng.uniform(-1.0, 1.0, size=COUNT) / (turned @ n)
        points[:, i] = finger + along[:, None] * n
        body = np.einsum("nji,nj->ni", R, points[:, i] - it.center - moves[:, :3]) + it.center
        hull = ConvexHull((it.landings[i] - x) @ u)
        beside = (body - x) @ u @ hull.equations[:, :2].T + hull.equations[:, 2]
        there &= (beside <= 0.0).all(axis=1) & (turned @ n > 0.0)
        angles = rng.uniform(0.0, 2.0 * np.pi, size=COUNT)
        aside = u @ np.array([np.cos(angles), np.sin(angles)])
        lean = math.tan(min(it.lean, 1.5)) * np.einsum("nij,jn->ni", R, aside)
        normals[:, i] = (turned + lean) / np.linalg.norm(turned + lean, axis=1, keepdims=True)
    if not there.any():
        return 0.0
    friction = np.repeat(mu[there, None], 4, axis=1)
    cones = ContactCones.at(unit_size(points[there])[0], normals[there], friction)
    return float(np.count_nonzero(decided_at_once(cones)[0])) / COUNT
