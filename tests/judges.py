"""Independent judges for tests: they share no code with what they judge."""

import numpy as np
from scipy.optimize import linprog

TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
TETRA_NORMALS = TETRAHEDRON / np.sqrt(3.0)
TETRA_CENTERS = -TETRAHEDRON / 3.0


def pyramid_wrenches(positions, normals, friction, sides, *, outer):
    """Wrenches of the edges of pyramids inside (or, with `outer`, around) the friction cones.

    About the contacts' mean point and at unit size; normal parts are one; (k * sides, 6).
    """
    center = positions.mean(axis=0)
    size = np.linalg.norm(positions - center, axis=1).max()
    slopes = np.full(len(positions), friction) / (np.cos(np.pi / sides) if outer else 1.0)
    turns = 2.0 * np.pi * np.arange(sides) / sides
    rows = []
    for point, normal, slope in zip(positions, normals, slopes, strict=True):
        tangent = np.linalg.svd(normal[None])[2][1:]
        edges = normal + slope * (
            np.cos(turns)[:, None] * tangent[0] + np.sin(turns)[:, None] * tangent[1]
        )
        rows.append(np.hstack([edges, np.cross((point - center) / size, edges)]))
    return np.vstack(rows)


def least_weight(W):
    """The least weight, as large as can be, of wrenches in combinations that balance.

    Positive means closure of wrenches of rank 6. Weights sum to one; -inf where none balance. By
    the dual program, which has seven variables only: the least z for twists y with w.y + z >= 0 for
    all wrenches w, where these slacks sum to one.
    """
    answer = linprog(
        np.append(np.zeros(6), 1.0),
        A_ub=-np.hstack([W, np.ones((len(W), 1))]), b_ub=np.zeros(len(W)),
        A_eq=[np.append(W.sum(axis=0), len(W))], b_eq=[1.0],
        bounds=[(None, None)] * 7, method="highs",
    )  # fmt: skip
    assert answer.status in {0, 3}, answer.message
    return answer.fun if answer.status == 0 else -np.inf


def picks_positively_span(axes, half_angle, sides):
    """Whether all choices of one generator from each of four pyramids positively span space.

    The determinant of three vectors is linear in each, so its sign over three pyramids is
    the sign over their edges: for pyramids this is Definition 3 without any approximation.
    The cones of axes (q, 4, 3) and half angles (q,) hold the pyramids' edges.
    """
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=2)]
    u = np.cross(helper, axes)
    u /= np.linalg.norm(u, axis=2, keepdims=True)
    v = np.cross(axes, u)
    turns = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.cos(turns)[:, None] * u[:, :, None] + np.sin(turns)[:, None] * v[:, :, None]
    slope = np.tan(half_angle)[:, None, None, None]
    edges = axes[:, :, None] + slope * ring
    spans = np.ones(len(axes), dtype=bool)
    expected = None
    for left_out in range(4):
        a, b, c = (edges[:, k] for k in range(4) if k != left_out)
        dets = np.einsum("qax,qbcx->qabc", a, np.cross(b[:, :, None], c[:, None, :]))
        sign = np.sign(dets[:, 0, 0, 0]) * (-1) ** left_out
        spans &= (np.sign(dets) == np.sign(dets[:, :1, :1, :1])).all(axis=(1, 2, 3))
        expected = sign if expected is None else expected
        spans &= sign == expected
    return spans


def balancing_weights(vectors):
    """Weights of sum w_i v_i = 0, sum |w_i| = 1, by Cramer's rule; positive if vectors span."""
    minors = np.stack([np.delete(vectors, i, axis=-2) for i in range(4)], axis=-3)
    signed = np.linalg.det(minors) * [1.0, -1.0, 1.0, -1.0]
    total = np.abs(signed).sum(axis=-1, keepdims=True)
    return signed / total * np.sign(signed.sum(axis=-1, keepdims=True))


def winding(corners, points):
    """The winding number of a closed mesh (t, 3, 3) about each point, by solid angles."""
    a, b, c = ((corners[None, :, k] - points[:, None]) for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    volume = np.einsum("pti,pti->pt", a, np.cross(b, c))
    spread = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return np.arctan2(volume, spread).sum(axis=1) / (2.0 * np.pi)


def random_contacts(rng, count=4, spread=0.7):
    """Contacts around the origin whose normals point roughly inwards."""
    positions = rng.normal(size=(count, 3))
    normals = -positions + spread * rng.normal(size=(count, 3))
    return positions, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def random_rotation(rng):
    """A uniformly random rotation matrix."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))
