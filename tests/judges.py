"""Independent judges for tests: they share no code with what they judge."""

import numpy as np
from scipy.optimize import linprog

TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
TETRA_NORMALS = TETRAHEDRON / np.sqrt(3.0)
TETRA_CENTERS = -TETRAHEDRON / 3.0


def pyramid_margin(positions, normals, friction, sides, *, outer):
    """Closure margin with pyramids inside (or, with `outer`, around) the friction cones.

    Maximises the smallest weight of the pyramids' edges over combinations that balance;
    positive means closure of the pyramids when their wrenches have rank 6.
    """
    center = positions.mean(axis=0)
    size = np.linalg.norm(positions - center, axis=1).max()
    columns = []
    slope = friction / np.cos(np.pi / sides) if outer else friction
    for point, normal in zip(positions, normals, strict=True):
        tangent = np.linalg.svd(normal[None])[2][1:]
        turns = 2.0 * np.pi * np.arange(sides) / sides
        edges = normal + slope * (
            np.cos(turns)[:, None] * tangent[0] + np.sin(turns)[:, None] * tangent[1]
        )
        arm = (point - center) / size
        columns.append(np.hstack([edges, np.cross(arm, edges)]))
    W = np.vstack(columns).T
    count = W.shape[1]
    rows = np.hstack([-np.eye(count), np.ones((count, 1))])
    equalities = np.vstack([np.append(W, np.zeros((6, 1)), axis=1), np.append(np.ones(count), 0.0)])
    answer = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=rows, b_ub=np.zeros(count),
        A_eq=equalities, b_eq=np.append(np.zeros(6), 1.0),
        bounds=[(None, None)] * (count + 1), method="highs",
    )  # fmt: skip
    assert answer.status in (0, 2), answer.message
    return answer.x[-1] if answer.status == 0 else -np.inf


def picks_positively_span(axes, half_angle, sides):
    """Whether all choices of one generator from each of four pyramids positively span space.

    The determinant of three vectors is linear in each, so its sign over three pyramids is
    the sign over their edges: for pyramids this is Definition 3 without any approximation.

    Args:
        axes: (q, 4, 3).
        half_angle: Of the cones on which the pyramids' edges lie, (q,).
        sides: Edges of each pyramid.
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
