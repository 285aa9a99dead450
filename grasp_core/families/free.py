"""Finds grasps of any type on four convex faces, or a proof that there is none (free method).

Solved: whether any four contacts, one on each of four convex faces, are in force closure at a
given friction, at any friction and for any normals.

Derivation. Put a contact at every corner of the four faces: the corner contacts, or patch. A
force at any point of a convex face is a convex combination of the same force at its corners, so

    four contacts on the faces in force closure  =>  the corner contacts in force closure. (1)

A separating twist of the corner contacts is therefore a proof of absence; by convexity of the
supports it separates every grasp on these faces.

If the patch is closed, its forces, added up face by face, say where four contacts balance, (4) to
(9). If no contacts are found in this way, patches of smaller random pieces of the faces are tried,
which give other forces (2). What is still open can be split (3): each face quadruple is cut through
its longest face, parts are dropped with their proof of absence, until a grasp is found, nothing is
left, or the budget is spent.

Nothing here depends on P3. The lines of force are of the most general type, as a rule a
regulus, with u, slopes and pitch free; so this also answers the freedom that the paper leaves
unused when it fixes the direction u (its section 4).

Four contacts from the patch. The patch's smallest forces f_k, all at least some depth inside their
friction cones, follow from

    minimise |f|  subject to  G f = 0,  sum_k n_k.f_k = 1,                              (4)
                              g.f_k >= depth,                                           (5)

g over the inward facet normals of a pyramid inscribed in each cone. As |f| is strictly convex, the
answer is unique: it turns with the object and rounding does not move it, unlike the point at which
an interior-point solver stops. With f = f_0 + Z z, f_0 the smallest solution of (4) and the columns
of Z an orthonormal basis of its null space, |f|^2 = |f_0|^2 + |z|^2 leaves a least-distance program
in z. These forces are added up face by face:

    F_i = sum of the forces at the corners of face i.                                   (6)

The F_i lie inside the cones and balance as forces. With them fixed, equilibrium is linear in the
positions x_i = o_i + T_i y_i:

    maximise t  subject to  sum_i (o_i + T_i y_i) x F_i = 0,                            (7)
                            e.y_i + t <= b                   for all i, edges.          (8)

Any solution inside the faces, unless all on one line, is in force closure. Among solutions nearly
as far from the edges as these forces allow, the one nearest to the middles of the faces is taken.
If there is none, the centres of pressure of the patch are tried as contacts (9).

Source: Sudsang & Ponce 1995, Propositions 1 and 3; the relaxation by many contacts on a face
is that of Omata's virtual fingers (1991), the rest is this project's.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.contacts import cross_matrix, grasp_map, normal_and_tangential
from grasp_core.closure.force_closure import certificates, force_closure
from grasp_core.closure.lines import classify_lines
from grasp_core.cones.pyramids import pyramid_facets
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.absence_certificate import (
    Absence,
    PartCorners,
    Path,
    corner_contacts,
    part_at,
)
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.qp import least_distance
from grasp_core.solvers.ties import graded
from grasp_core.stopping import never
from grasp_core.values import FINGERS, four

SMALLER = 0.5
"""Size of randomly shrunk pieces, relative to the piece."""
PATCH_SIDES = 8
ZERO_SINGULAR = 1e-6
"""Singular values smaller than this, relative to the largest, are zero but for rounding."""
FREE_INSET = 1e-4
"""Least distance of a contact from the edges of its face, in object radii."""
DEPTH_KEPT = 0.5
"""Share of the patch's margin that its forces keep inside their cones."""
LEAST_WEIGHT = 1e-12
"""Least weight of a corner in a centre of pressure: keeps the weights' sum above zero."""
INSET_KEPT = 0.9
"""Share of the largest distance from the edges that contacts keep when they move to the middles."""
SAME_PLANE = 1e-6
"""Moments smaller than this, relative to the largest, are rounding: the forces lie in a plane."""
LEAST_SPREAD = 1e-3
"""Least extent of the contacts across the line they are closest to, in object radii."""
RESTARTS = 12
"""Default number of smaller random patches that are tried."""


def grasp_from_patch(
    pieces: Sequence[FacePiece], part: PartCorners, patch: ClosureCertificate, friction: float
) -> Placement | None:
    """Find a grasp from balanced forces at the corners of faces; None if all attempts fail."""
    if patch.forces is None:
        return None
    owner = np.repeat(np.arange(FINGERS), [len(corners) for corners in part])
    at_corners = smallest_forces(
        [pieces[int(i)] for i in owner], patch.positions, patch.normals, friction,
        DEPTH_KEPT * patch.margin,
    )  # fmt: skip
    at_corners = patch.forces if at_corners is None else at_corners
    # (6); the mean takes away what rounding leaves of the sum
    forces = np.array([at_corners[owner == i].sum(axis=0) for i in range(FINGERS)])
    if found := place_by_forces(pieces, forces - forces.mean(axis=0)):
        return found
    # (9): pressed harder, a corner draws the contact nearer
    pushes, _ = normal_and_tangential(at_corners, patch.normals)
    weights = np.maximum(pushes, LEAST_WEIGHT)
    at = [owner == i for i in range(FINGERS)]
    centers = np.array(
        [np.average(patch.positions[own], axis=0, weights=weights[own]) for own in at]
    )
    inset = min(piece.inset(at) for piece, at in zip(pieces, centers, strict=True))
    if inset < FREE_INSET or _on_one_line(centers):
        return None
    return closed_at(pieces, centers, friction, inset)


def smallest_forces(
    pieces: Sequence[FacePiece], points: Array, normals: Array, friction: float, depth: float
) -> Array | None:
    """Find the smallest balanced forces at points of pieces, (k, 3), or None if there are none."""
    # (4): f_0 is the least-squares solution, Z spans what it leaves free
    conditions = np.vstack([grasp_map(points), normals.reshape(1, -1)])
    left, sizes, right = np.linalg.svd(conditions)
    rank = int((sizes > ZERO_SINGULAR * sizes[0]).sum())
    Z = right[rank:].T
    f_0 = right[:rank].T @ (left[-1, :rank] / sizes[:rank])
    toward = np.array([piece.frame[:, 0] for piece in pieces])
    facets = pyramid_facets(normals, math.atan(friction), toward, PATCH_SIDES)
    # (5) in z: -(G_f Z) z <= G_f f_0 - depth
    rows = np.einsum("ksi,kiz->ksz", facets, Z.reshape(len(points), 3, -1)).reshape(-1, Z.shape[1])
    here = np.einsum("ksi,ki->ks", facets, f_0.reshape(-1, 3)).ravel()
    z = least_distance(-rows, here - depth)
    return None if np.isnan(z).any() else (f_0 + Z @ z).reshape(-1, 3)


def place_by_forces(pieces: Sequence[FacePiece], forces: Array) -> Placement | None:
    """Place contacts where forces balance, far from the edges; None near one or on one line."""
    A_eq = np.zeros((3, 2 * FINGERS + 1))
    b_eq = np.zeros(3)
    rows: list[Array] = []
    limits: list[Array] = []
    for i, (piece, force) in enumerate(zip(pieces, forces, strict=True)):
        # (7): x_i x F_i = -F_i x (o_i + T_i y_i)
        turn = -cross_matrix(force)
        A_eq[:, 2 * i : 2 * i + 2] = turn @ piece.frame
        b_eq -= turn @ piece.origin
        # (8): contacts keep a distance t from the edges
        inside = np.zeros((len(piece.E), 2 * FINGERS + 1))
        inside[:, 2 * i : 2 * i + 2], inside[:, -1] = piece.E, 1.0
        rows.append(inside)
        limits.append(piece.b)
    objective = np.eye(2 * FINGERS + 1)[-1]
    scale = float(np.abs(forces).max())
    found = maximize(
        # scaling (7) by the largest force leaves the solver numbers of size one
        LinearProgram(objective, np.vstack(rows), np.hstack(limits), A_eq / scale, b_eq / scale)
    )
    if not isinstance(found, Optimum) or INSET_KEPT * found.value < FREE_INSET:
        return None
    edges, ends = np.vstack(rows)[:, :-1], np.hstack(limits)
    inside = ends - INSET_KEPT * found.value
    y = _nearest_to_middles(pieces, found.x[:-1], A_eq[:, :-1], edges, inside)
    positions = np.array(
        [piece.point(at) for piece, at in zip(pieces, y.reshape(FINGERS, 2), strict=True)]
    )
    if _on_one_line(positions):
        return None
    inset = float((ends - edges @ y).min())
    return Placement(positions, forces, np.empty((0, 3)), np.zeros(FINGERS), inset)


def _nearest_to_middles(
    pieces: Sequence[FacePiece], start: Array, A_eq: Array, rows: Array, limits: Array
) -> Array:
    """Find balanced contacts with rows @ y <= limits that are nearest to the pieces' middles, (8,).

    They are unique, unlike the contacts farthest from the edges, so they turn with the object.
    """
    _, sizes, right = np.linalg.svd(A_eq)
    # the null space of (7): moves along it keep the balance
    free = right[int((sizes > SAME_PLANE * sizes[0]).sum()) :].T
    middles = np.concatenate([piece.corners.mean(axis=0) for piece in pieces])
    y = start + free @ (free.T @ (middles - start))
    step = least_distance(rows @ free, limits - rows @ y)
    return start if np.isnan(step).any() else y + free @ step


def closed_at(
    pieces: Sequence[FacePiece], positions: Array, friction: float, merit: float
) -> Placement | None:
    """Make a placement, with forces that close it, at contacts on pieces; None if they do not."""
    normals = np.array([piece.normal for piece in pieces])
    try:
        certificate = force_closure(positions, normals, friction)
    except UndecidedError:
        return None
    if certificate.forces is None:
        return None
    return Placement(positions, certificate.forces, np.empty((0, 3)), np.zeros(FINGERS), merit)


def _on_one_line(positions: Array) -> bool:
    """Return whether contacts are so near one line that they hardly resist turning about it."""
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    return bool(spread[1] < LEAST_SPREAD)


def of_general_type(
    pieces: Sequence[FacePiece], found: Placement, friction: float, rng: np.random.Generator
) -> Placement | None:
    """Give a placement forces whose lines form a regulus, at the same contacts.

    On symmetric faces the patch's forces may all meet, or lie in one plane. Adding internal
    forces, half as large as the cones have room for, makes the lines skew. The result is None
    where that room is too small to tell.
    """
    if classify_lines(found.positions, found.forces) == "regulus":
        return found
    normals = np.array([piece.normal for piece in pieces])
    G = grasp_map(found.positions)
    drawn = np.concatenate(
        [np.column_stack([piece.normal, piece.frame]) @ rng.normal(size=3) for piece in pieces]
    )
    # internal forces make no wrench: take away the part of the drawn ones that does
    internal = (drawn - np.linalg.pinv(G) @ (G @ drawn)).reshape(FINGERS, 3)
    along, across = normal_and_tangential(found.forces, normals)
    inward, sideways = normal_and_tangential(internal, normals)
    room = (friction * along - across) / (sideways + friction * np.abs(inward))
    forces = found.forces + 0.5 * float(room.min()) * internal
    pushes = float(np.einsum("ki,ki->", forces, normals))
    if classify_lines(found.positions, forces) != "regulus":
        return None
    return replace(found, forces=forces / pushes, planned=found.forces)


@dataclass(frozen=True, slots=True)
class Undecided:
    """The answer when the free method found neither a grasp nor a proof within its budget."""

    open_share: float
    """Share of all choices of contacts that is undecided, where each cut counts for half."""


def place_free(
    pieces: Sequence[FacePiece],
    friction: float,
    *,
    rng: np.random.Generator,
    cells: int = 1,
    restarts: int = RESTARTS,
    whole: ClosureCertificate | None = None,
    stop: Callable[[], bool] = never,
) -> Placement | Absence | Undecided:
    """Find a grasp of four convex pieces, or prove that there is none, until told to stop."""
    if not friction > 0.0:
        raise InputError(f"friction must be greater than 0, got {friction}")
    leaves: list[tuple[Path, ClosureCertificate]] = []
    waiting: list[tuple[float, Path]] = [(0.0, ())]
    examined = 0
    while waiting and examined < cells and not stop():
        _, path = heappop(waiting)
        part = part_at(pieces, path)
        known = None if path else whole
        patch = close_patch(pieces, part, friction) if known is None else known
        examined += 1
        # (1): this part holds no grasp
        if patch is not None and not patch.closed:
            leaves.append((path, patch))
            continue
        found = grasp_from_patch(pieces, part, patch, friction) if patch is not None else None
        # (2), once for the whole pieces
        if found is None and not path:
            found = _restarted(pieces, friction, rng, restarts)
        if found is not None:
            general = of_general_type(pieces, found, friction, rng)
            return general or Undecided(_share([*waiting, (0.0, path)]))
        margin = patch.margin if patch is not None else 0.0
        # (3): parts with the largest margin are examined first
        for half in (0, 1):
            heappush(waiting, (-graded(margin), (*path, half)))
    if waiting:
        return Undecided(_share(waiting))
    return Absence(four(pieces), friction, tuple(leaves))


def _share(waiting: Sequence[tuple[float, Path]]) -> float:
    return sum(0.5 ** len(path) for _, path in waiting)


def close_patch(
    pieces: Sequence[FacePiece], part: PartCorners, friction: float
) -> ClosureCertificate | None:
    """Decide force closure of contacts at all corners of a part; None if too close to call."""
    try:
        return force_closure(*corner_contacts(pieces, part), friction)
    except UndecidedError:
        return None


def close_patches(
    quadruples: Sequence[Sequence[FacePiece]], friction: float
) -> list[ClosureCertificate | None]:
    """Decide `close_patch` for many sets of whole pieces; None where it has to decide alone."""
    contacts = [corner_contacts(pieces, part_at(pieces, ())) for pieces in quadruples]
    sizes = np.array([len(points) for points, _ in contacts], dtype=np.int64)
    found: list[ClosureCertificate | None] = [None] * len(quadruples)
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size).tolist()
        points, normals = (np.array([contacts[i][each] for i in alike]) for each in (0, 1))
        for place, known in zip(alike, certificates(points, normals, friction), strict=True):
            found[place] = known
    return found


def _restarted(
    pieces: Sequence[FacePiece], friction: float, rng: np.random.Generator, restarts: int
) -> Placement | None:
    """Try patches of the four pieces, each shrunk about a random point of it."""
    for _ in range(restarts):
        parts: list[Array] = []
        for piece in pieces:
            about = rng.dirichlet(np.ones(len(piece.corners))) @ piece.corners
            parts.append(about + SMALLER * (piece.corners - about))
        part = tuple(parts)
        patch = close_patch(pieces, part, friction)
        if patch is not None and (found := grasp_from_patch(pieces, part, patch, friction)):
            return found
    return None
