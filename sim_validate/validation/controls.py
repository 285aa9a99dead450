"""Makes negative controls: contact sets derived from a grasp that are proved not force-closed.

A validator that never rejects anything proves nothing. Each control therefore carries a proof: a
separating wrench that no contact forces within the friction cones oppose, whatever the fingers do.
This wrench is the first load that the control is tested with.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices, cross
from grasp_core.by_value import ByValue
from grasp_core.closure.contacts import stacked, unit_size
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.decision import deepest_forces
from grasp_core.closure.force_closure import ClosureCertificate, force_closure
from grasp_core.errors import SolverError, UndecidedError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from sim_validate.validation.paper_as_printed import uncorrected_contacts

FRICTION_SHARE = 0.9
"""Friction of the low-friction control, relative to the lowest at which the grasp is in closure."""
LEAST_FRICTION = 1e-4
"""Lowest friction of a negative control; the simulator's own limit is 1e-5."""
SEARCH = 64
"""Number of random displacements of the contacts that are tried to lose force closure."""
KEPT = 64
"""How many quadruples of faces keep their uncorrected contacts for the next grasp."""
SURE = 1e-9
"""Margin of closure above which compiled code is trusted where nothing depends on it."""
TOWARD_CORNER = 0.95
"""How far a moved contact goes towards a corner of its face, as a share of the way."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Control(ByValue):
    """A negative control: contacts that must not hold, with the proof that they cannot."""

    name: str
    contacts: tuple[Contact, ...]
    friction: float
    certificate: ClosureCertificate

    def separating_wrench(self, center: Array) -> Array:
        """The wrench that the contacts provably cannot resist, (6,), with torque about `center`."""
        wrench = self.certificate.separating_wrench
        assert wrench is not None  # noqa: S101 - controls are refuted by construction
        return np.concatenate([wrench[:3] + cross(wrench[3:], center), wrench[3:]])


def negative_controls(
    body: Polyhedron, grasp: Grasp, friction: float, seed: int, torsion_m: float = 0.0
) -> tuple[Control, ...]:
    """Make the negative controls that exist for a grasp, at most one of each kind.

    The kinds are friction below the critical one, fingers removed, a normal flipped, contacts moved
    on their faces, which takes them out of the grasp's region, and the paper's uncorrected
    constructions on the same faces. With torsion all of them are proved open as soft fingers.

    Takes `torsion_m` [m].
    """
    rng = np.random.default_rng(seed)
    candidates = (
        _low_friction(grasp, torsion_m),
        _fingers_removed(grasp, friction, torsion_m),
        _normal_flipped(grasp, friction, torsion_m),
        _contacts_moved(body, grasp, friction, torsion_m, rng),
        _uncorrected(body, grasp, friction, torsion_m),
    )
    return tuple(found for tries in candidates if (found := next(tries, None)) is not None)


def _low_friction(grasp: Grasp, torsion_m: float) -> Iterator[Control]:
    friction = FRICTION_SHARE * grasp.critical_friction
    if friction >= LEAST_FRICTION:
        yield from _refuted("low_friction", grasp.contacts, friction, torsion_m)


def _fingers_removed(grasp: Grasp, friction: float, torsion_m: float) -> Iterator[Control]:
    """Yield a negative control with one finger fewer, at lower friction if needed, or two fewer.

    Without friction no three contacts are in closure, so any three are open below some friction.
    Two hard contacts are open at any friction, because the object can always turn about the line
    between them.
    """
    threes = list(combinations(grasp.contacts, 3))
    for rest in threes:
        yield from _refuted("fingers_removed", rest, friction, torsion_m)
    for rest in threes:
        lower = FRICTION_SHARE * _critical(rest, torsion_m)
        if LEAST_FRICTION <= lower <= friction:
            yield from _refuted("fingers_removed", rest, lower, torsion_m)
    for rest in combinations(grasp.contacts, 2):
        yield from _refuted("fingers_removed", rest, friction, torsion_m)


def _critical(contacts: Sequence[Contact], torsion_m: float) -> float:
    """The lowest friction at which contacts are force-closed; infinity if it is not known."""
    try:
        return critical_friction(*stacked(contacts), torsion_m=torsion_m)
    except (SolverError, UndecidedError):
        return math.inf


def _normal_flipped(grasp: Grasp, friction: float, torsion_m: float) -> Iterator[Control]:
    """Flip a normal, so that a finger pulls instead of pushing, as a wrong sign in a file would."""
    for finger, contact in enumerate(grasp.contacts):
        contacts = list(grasp.contacts)
        contacts[finger] = replace(contact, normal=-contact.normal)
        yield from _refuted("normal_flipped", contacts, friction, torsion_m)


def _uncorrected(
    body: Polyhedron, grasp: Grasp, friction: float, torsion_m: float
) -> Iterator[Control]:
    """Yield contacts that the paper's printed programs accept, but that are not closed.

    They depend on the faces alone, so grasps on the same faces have the same ones.
    """
    control = _uncorrected_on(body, tuple(sorted(grasp.faces)), friction, torsion_m)
    if control is not None:
        yield control


@lru_cache(maxsize=KEPT)
def _uncorrected_on(
    body: Polyhedron, faces: tuple[int, ...], friction: float, torsion_m: float = 0.0
) -> Control | None:
    try:
        for supposed, positions, normals in uncorrected_contacts(body, faces, friction):
            for points in positions[_may_be_open(positions, normals, supposed)]:
                contacts = [Contact(at, way) for at, way in zip(points, normals, strict=True)]
                for control in _refuted("uncorrected", contacts, supposed, torsion_m):
                    return control
    except SolverError:
        pass
    return None


def _may_be_open(positions: Array, normals: Array, friction: float) -> Indices:
    """Find sets of contacts, of (g, k, 3), that compiled code does not find closed.

    This only saves proofs: a set that is left out makes no control, and the others are proved.
    """
    arms, _, _ = unit_size(positions)
    every = np.broadcast_to(normals, positions.shape)
    _, _, margins = deepest_forces(arms, every, np.full(len(positions), friction))
    return np.flatnonzero(~((margins[:, 0] > SURE) & (margins[:, 1] >= margins[:, 0])))


def _contacts_moved(
    body: Polyhedron, grasp: Grasp, friction: float, torsion_m: float, rng: np.random.Generator
) -> Iterator[Control]:
    pieces = [body.faces[face].pieces for face in grasp.faces]
    for _ in range(SEARCH):
        moved = [
            Contact(_near_corner(choice, rng), contact.normal)
            for choice, contact in zip(pieces, grasp.contacts, strict=True)
        ]
        yield from _refuted("contacts_moved", moved, friction, torsion_m)


def _near_corner(pieces: Sequence[Array], rng: np.random.Generator) -> Array:
    """A random point of a face next to one of its corners."""
    piece = pieces[int(rng.integers(len(pieces)))]
    corner, middle = piece[int(rng.integers(len(piece)))], piece.mean(axis=0)
    return middle + TOWARD_CORNER * (corner - middle)


def _refuted(
    name: str, contacts: Sequence[Contact], friction: float, torsion_m: float
) -> Iterator[Control]:
    """Yield the negative control if the analysis proves that it is not force-closed."""
    try:
        certificate = force_closure(*stacked(contacts), friction, torsion_m=torsion_m)
    except UndecidedError:
        return
    if not certificate.closed:
        yield Control(name, tuple(contacts), friction, certificate)
