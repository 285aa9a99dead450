"""Finds grasps of any type on four convex faces, or a proof that there is none (free method).

Solved: whether any four contacts, one on each of four convex faces, are in force closure at a
given friction, at any friction and for any normals.

Derivation. Put a contact at every corner of the four faces: the corner contacts. A force at any
point of a convex face is a convex combination of the same force at its corners, so

    four contacts on the faces in force closure  =>  the corner contacts in force closure. (1)

A separating twist of the corner contacts is therefore a proof of absence; by convexity of the
supports it separates every grasp on these faces.

If the corner contacts are in closure, take the smallest forces that show it and add them face by
face:

    F_i = sum of the forces at the corners of face i.                                    (2)

The F_i lie inside the cones and balance as forces. With them fixed, equilibrium is linear in the
positions x_i = o_i + T_i y_i:

    maximise t  subject to  sum_i (o_i + T_i y_i) x F_i = 0,                             (3)
                            e.y_i + t <= b                   for all i, edges.           (4)

Any solution inside the faces, unless all contacts are on one line, is in force closure. Among
solutions nearly as far from the edges as these forces allow, the one nearest to the middles of the
faces is taken. If there is none, the centres of pressure of the corner forces are tried as contacts
(5), then the corners of smaller random pieces of the faces, which give other forces (6). What is
still undecided can be divided (7): each face quadruple is cut through its longest face, and parts
are dropped with their proof of absence, until a grasp is found, nothing is left, or the budget is
spent.

Nothing here depends on P3. The lines of force are of the most general type, as a rule a
regulus, with u, slopes and pitch free; so this also answers the freedom that the paper leaves
unused when it fixes the direction u (its section 4).

Source: Sudsang & Ponce 1995, Propositions 1 and 3; the relaxation by many contacts on a face
is that of Omata's virtual fingers (1991), the rest is this project's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import ClosureCertificate, force_closure
from grasp_core.closure.lines import classify_lines
from grasp_core.closure.wrenches import cross_matrix, grasp_map, normal_and_tangential
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.face_parts import (
    Corners,
    Path,
    corner_contacts,
    cover_everything,
    is_path,
    part_at,
    random_parts,
)
from grasp_core.families.free_forces import smallest_forces
from grasp_core.families.placements import Placement
from grasp_core.fields import are_frictions, is_a, is_tuple_of
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.nearest_point import least_distance
from grasp_core.solvers.ties import graded
from grasp_core.values import FINGERS

RESTARTS = 12
"""Default number of smaller random pieces on which the method is tried again."""
LEAST_INSET = 1e-4
"""Least distance of a contact from the edges of its face, in object radii."""
DEPTH_KEPT = 0.5
"""Share of the margin of all corner contacts that their forces keep inside the cones."""
ROUNDED = 1e-12
"""Least weight of a corner in a centre of pressure; it keeps the sum of the weights above zero."""
INSET_KEPT = 0.9
"""Share of the largest distance from the edges that contacts keep while they move to the middles of
faces."""
SAME_PLANE = 1e-6
"""Moment, relative to the largest, below which it is rounding and the forces lie in a plane."""
LEAST_SPREAD = 1e-3
"""Least extent of the contacts across the line they are closest to, in object radii."""


SAME_CORNERS = 1e-12
"""Distance of a proof's contacts from the corners of its part that counts as rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Absence:
    """A proof that no four contacts on four convex pieces are in force closure."""

    pieces: tuple[FacePiece, ...]
    friction: float
    leaves: tuple[tuple[Path, ClosureCertificate], ...]
    """Parts that together cover the pieces, each with a twist that separates contacts at all its
    corners."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic.

        This checks that the pieces are convex polygons, and that the parts cover them and are all
        separated. Whoever has the object checks that the pieces are parts of its faces.
        """
        with np.errstate(all="ignore"):
            return (
                are_frictions(np.array([self.friction]), 1)
                and is_tuple_of(self.pieces, FacePiece, FINGERS)
                and all(piece.sound() for piece in self.pieces)
                and is_tuple_of(self.leaves, tuple)
                and all(len(leaf) == len(("path", "proof")) for leaf in self.leaves)
                and all(is_path(path) for path, _ in self.leaves)
                and cover_everything([path for path, _ in self.leaves])
                and all(self._separated(path, proof) for path, proof in self.leaves)
            )

    def _separated(self, path: Path, proof: ClosureCertificate) -> bool:
        if not is_a(proof, ClosureCertificate) or proof.closed is not False:
            # a twist that separates at more friction separates at less
            return False
        if not proof.verify() or float(proof.friction.min()) < self.friction:
            return False
        points, normals = corner_contacts(self.pieces, part_at(self.pieces, path))
        return (
            proof.positions.shape == points.shape
            and float(np.abs(proof.positions - points).max()) <= SAME_CORNERS
            and float(np.abs(proof.normals - normals).max()) <= SAME_CORNERS
            and replace(proof, positions=points, normals=normals).separates()
        )


@dataclass(frozen=True, slots=True)
class Undecided:
    """The answer when the free method found neither a grasp nor a proof within its budget."""

    open_parts: int
    open_share: float
    """Share of all choices of contacts that is undecided, where each cut counts for half."""


def place_free(
    pieces: Sequence[FacePiece],
    friction: float,
    *,
    rng: np.random.Generator,
    cells: int = 1,
    restarts: int = RESTARTS,
) -> Placement | Absence | Undecided:
    """Find a grasp of four convex pieces, or prove that there is none.

    Args:
        pieces: Four convex pieces, in finger order, in units where the object has size one.
        friction: Coulomb coefficient at every contact, positive.
        rng: Source of the random restarts.
        cells: Largest number of parts of the pieces to examine; with 1 nothing is divided.
        restarts: Number of smaller random pieces to try before giving up or dividing.

    Raises:
        InputError: The friction is not positive.
        SolverError: A program's answer failed its check.
    """
    if not friction > 0.0:
        raise InputError(f"friction must be greater than 0, got {friction}")
    leaves: list[tuple[Path, ClosureCertificate]] = []
    waiting: list[tuple[float, Path]] = [(0.0, ())]
    examined = 0
    while waiting and examined < cells:
        _, path = heappop(waiting)
        part = part_at(pieces, path)
        patch = close_patch(pieces, part, friction)
        examined += 1
        # (1): this part holds no grasp
        if patch is not None and not patch.closed:
            leaves.append((path, patch))
            continue
        found = _grasp(pieces, part, patch, friction) if patch is not None else None
        # (6), once for the whole pieces
        if found is None and not path:
            found = _restarted(pieces, friction, rng, restarts)
        if found is not None:
            general = of_general_type(pieces, found, friction, rng)
            return general or Undecided(len(waiting) + 1, _share([*waiting, (0.0, path)]))
        margin = patch.margin if patch is not None else 0.0
        # (7): parts with the largest margin are examined first
        for half in (0, 1):
            heappush(waiting, (-graded(margin), (*path, half)))
    if waiting:
        return Undecided(len(waiting), _share(waiting))
    return Absence(tuple(pieces), friction, tuple(leaves))


def _share(waiting: Sequence[tuple[float, Path]]) -> float:
    return sum(0.5 ** len(path) for _, path in waiting)


def close_patch(
    pieces: Sequence[FacePiece], part: Corners, friction: float
) -> ClosureCertificate | None:
    """Decide force closure of contacts at all corners of a part; None if too close to call."""
    try:
        return force_closure(*corner_contacts(pieces, part), friction)
    except UndecidedError:
        return None


def place_by_forces(pieces: Sequence[FacePiece], forces: Array) -> Placement | None:
    """Place contacts at which given forces balance, as far from the edges as possible.

    Args:
        pieces: Four convex pieces.
        forces: One force per piece, summing to zero, (4, 3).

    Returns:
        The placement; None if the contacts would be too near an edge or on one line.
    """
    A_eq = np.zeros((3, 2 * FINGERS + 1))
    b_eq = np.zeros(3)
    rows: list[Array] = []
    limits: list[Array] = []
    for i, (piece, force) in enumerate(zip(pieces, forces, strict=True)):
        # (3): x_i x F_i = -F_i x (o_i + T_i y_i)
        turn = -cross_matrix(force)
        A_eq[:, 2 * i : 2 * i + 2] = turn @ piece.frame
        b_eq -= turn @ piece.origin
        # (4): contacts keep a distance t from the edges
        inside = np.zeros((len(piece.E), 2 * FINGERS + 1))
        inside[:, 2 * i : 2 * i + 2], inside[:, -1] = piece.E, 1.0
        rows.append(inside)
        limits.append(piece.b)
    objective = np.eye(2 * FINGERS + 1)[-1]
    scale = float(np.abs(forces).max())
    found = maximize(
        # scaling (3) by the largest force leaves the solver numbers of size one
        LinearProgram(objective, np.vstack(rows), np.hstack(limits), A_eq / scale, b_eq / scale)
    )
    if not isinstance(found, Optimum) or INSET_KEPT * found.value < LEAST_INSET:
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
    """Find the balanced contacts nearest to the pieces' middles, (8,).

    They satisfy rows @ y <= limits. They are unique, unlike the contacts farthest from the edges,
    so they turn with the object.
    """
    _, sizes, right = np.linalg.svd(A_eq)
    # the null space of (3): moves along it keep the balance
    free = right[int((sizes > SAME_PLANE * sizes[0]).sum()) :].T
    middles = np.concatenate([piece.corners.mean(axis=0) for piece in pieces])
    y = start + free @ (free.T @ (middles - start))
    (step,) = least_distance(rows @ free, (limits - rows @ y)[None])
    return start if np.isnan(step).any() else y + free @ step


def _grasp(
    pieces: Sequence[FacePiece], part: Corners, patch: ClosureCertificate, friction: float
) -> Placement | None:
    """Make a placement from the forces at a closed part's corners; None if no attempt holds."""
    if patch.forces is None:
        return None
    owner = np.repeat(np.arange(FINGERS), [len(corners) for corners in part])
    at_corners = smallest_forces(
        [pieces[int(i)] for i in owner], patch.positions, patch.normals, friction,
        DEPTH_KEPT * patch.margin,
    )  # fmt: skip
    at_corners = patch.forces if at_corners is None else at_corners
    # (2); the mean takes away what rounding leaves of the sum
    forces = np.array([at_corners[owner == i].sum(axis=0) for i in range(FINGERS)])
    if found := place_by_forces(pieces, forces - forces.mean(axis=0)):
        return found
    # (5): pressed harder, a corner draws the contact nearer
    pushes, _ = normal_and_tangential(at_corners, patch.normals)
    weights = np.maximum(pushes, ROUNDED)
    centers = np.array(
        [
            np.average(patch.positions[owner == i], axis=0, weights=weights[owner == i])
            for i in range(FINGERS)
        ]
    )
    return _held_at(pieces, centers, friction)


def of_general_type(
    pieces: Sequence[FacePiece], found: Placement, friction: float, rng: np.random.Generator
) -> Placement | None:
    """Change the forces of a placement so that their lines form a regulus.

    The contacts stay the same. On symmetric faces the forces at the corners may all meet, or lie in
    one plane. Adding internal forces, half as large as the cones allow, makes the lines skew. The
    result is None where the cones allow too little to tell.
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


def _held_at(pieces: Sequence[FacePiece], positions: Array, friction: float) -> Placement | None:
    """Make a placement at given contacts if they are in force closure; None otherwise."""
    inset = min(
        float((piece.b - piece.E @ (piece.frame.T @ (at - piece.origin))).min())
        for piece, at in zip(pieces, positions, strict=True)
    )
    normals = np.array([piece.normal for piece in pieces])
    try:
        certificate = force_closure(positions, normals, friction)
    except UndecidedError:
        return None
    if certificate.forces is None or inset < LEAST_INSET or _on_one_line(positions):
        return None
    return Placement(positions, certificate.forces, np.empty((0, 3)), np.zeros(FINGERS), inset)


def _on_one_line(positions: Array) -> bool:
    """Return whether contacts are so near one line that they hardly resist turning about it."""
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    return bool(spread[1] < LEAST_SPREAD)


def _restarted(
    pieces: Sequence[FacePiece], friction: float, rng: np.random.Generator, restarts: int
) -> Placement | None:
    for part in random_parts(pieces, rng, restarts):
        patch = close_patch(pieces, part, friction)
        if patch is not None and (found := _grasp(pieces, part, patch, friction)):
            return found
    return None
