"""A grip: contacts squeezed with fixed commands by fingertips on springs, and its stiffness.

Fingertip i is a sphere of radius rho that slides with the palm and does not turn. A spring of
stiffness K_i, (3, 3), connects it to the palm. At rest it pushes with the squeeze f_i, and

    sum_i f_i = 0,   sum_i r_i x f_i = 0,                                                 (1)

with the arms r_i from the object's centre of mass to the contacts. The commands stay as they are
when a load comes. While no contact slips, a small motion of the object by a translation d and a
turn t (world axes) carries the points of contact along, so the centre of tip i moves by

    dc_i = d + t x r_i,                                                                   (2)

and its spring changes the force by

    df_i = -K_i dc_i.                                                                     (3)

The tip rolls on the turning face: the point of contact is at rho n_i from the tip's centre, and n_i
turns with the face, so the point of contact moves by dc_i + rho t x n_i. With s_i = r_i + rho n_i
the wrench (force, torque about the centre of mass) of all contacts changes by

    sum_i (df_i,  r_i x df_i + (t x s_i) x f_i) = -(K + K_g) (d, t),                      (4)

    K   = sum_i W_i K_i W_i',   W_i = [1; [r_i x]],
    K_g = sum_i [0 0; 0  (s_i . f_i) 1 - s_i f_i'].                                       (5)

K is the elastic part. K_g is the geometric part: arms point against pushes, s_i . f_i is mostly
negative, and so a squeeze makes a grasp less stiff against turning; large fingertips help. The grip
is stable if the symmetric part of K + K_g is positive definite, and otherwise unstable as executed,
whatever its force closure says. A load w moves the object by (K + K_g)^-1 w. Along the axes of
contact i, which turn with the object, the contact force then changes by

    A_i w,   A_i = F_i' (-K_i W_i' + [0, [f_i x]]) (K + K_g)^-1,                          (6)

with the contact's frame F_i = (normal, tangent, tangent): by (3), and by -t x f_i since the
frame turns under a force that does not.

Sources: Nguyen, "Constructing stable grasps" (1989); Cutkosky & Kao, "Computing and controlling
compliance of a robotic hand" (1989); Howard & Kumar, "On the stability of grasped objects" (1996).
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, instance
from grasp_core.arrays import Array, Frictions, Shape, UnitVectors, frozen, frozen_each, real_array
from grasp_core.closure.contacts import (
    LEAST_CONTACTS,
    WRENCH,
    contact_arrays,
    contact_frames,
    contact_frictions,
    cross_matrix,
    grasp_map,
    listed_contacts,
    stacked,
)
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.objects.on_faces import check_body, check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp

Bounded = Annotated[Array, Shape("k", 3, least=-LARGEST, most=LARGEST)]
"""A vector of plausible size for each of k contacts, (k, 3)."""
SYMMETRIC = 1e-9
"""How far the matrix of a spring may be from symmetric, relative to its largest eigenvalue."""
STIFFNESS_N_PER_M = 2000.0
"""Stiffness of a fingertip unless stated: a soft pad or a compliant finger, 5 N at 2.5 mm."""
TIP_RADIUS_M = 0.01
"""Radius of a fingertip unless stated: that of a human one, and of many that are sold [m]."""
STIFF = 1e-9
"""Share of the largest stiffness that is none: two fingers alone leave as little by rounding."""
SQUEEZE_BALANCED = 1e-6
"""Largest wrench of a squeeze, relative to the sum of its forces (times the longest arm)."""


def springs(stiffness: ArrayLike, count: int) -> Array:
    """Return checked matrices [N/m] of fingertips, (count, 3, 3), of one number or one each."""
    if real_array(stiffness, "stiffness").ndim < len(("finger", "row", "column")):
        each = frozen_each(stiffness, count, "stiffness")
        stiffness = each[:, None, None] * np.eye(3)
    K = frozen(stiffness, (count, 3, 3), "stiffness")
    if not are_springs(K):
        raise InputError(
            "stiffness must be positive, or matrices that are symmetric and positive definite, "
            f"with eigenvalues from {SMALLEST:g} to {LARGEST:g} N/m"
        )
    return K


def are_springs(K: Array) -> bool:
    """Return whether matrices (k, 3, 3) are symmetric, positive definite and of plausible size."""
    if float(np.abs(K).max()) > LARGEST:
        return False
    values = np.linalg.eigvalsh(K)
    odd = np.abs(K - np.swapaxes(K, 1, 2)).max(axis=(1, 2))
    return bool((values >= SMALLEST).all() and (odd <= SYMMETRIC * values[:, -1]).all())


@declared(slots=False)
class Grip(Declared):
    """Contacts on an object, held by fingertips on springs with a squeeze that is never replanned.

    Everything is along the world's axes and about the object's centre of mass.
    """

    arms: Bounded
    """Contact points from the centre of mass, (k, 3) [m]."""
    normals: UnitVectors
    """Unit normals into the object, (k, 3)."""
    friction: Frictions
    """Coulomb coefficients, (k,)."""
    squeeze: Bounded
    """Contact forces at rest, on the object, (k, 3) [N]; zero in sum, with their torques."""
    stiffness: Annotated[Array, Shape("k", 3, 3)]
    """Stiffness of each fingertip's spring, (k, 3, 3) [N/m], symmetric and positive definite."""
    tip_radius_m: Annotated[Array, Shape("k", least=0.0, most=LARGEST)]
    """Radii of the spherical fingertips, (k,) [m]."""

    def squeezed(self, squeeze: Array) -> "Grip":
        """Return the same contacts and springs with another squeeze, (k, 3) [N]."""
        return replace(self, squeeze=squeeze)

    def _is_consistent(self) -> bool:
        plain = replace(self)  # without what it has kept, which may be anything
        return (
            len(self.friction) >= LEAST_CONTACTS and are_springs(self.stiffness) and plain.balanced
        )

    @property
    def left(self) -> Array:
        """The wrench that is left of (1), (6,) [N, N m]."""
        return grasp_map(self.arms) @ self.squeeze.ravel()

    @property
    def imbalance(self) -> float:
        """Largest part of the wrench that is left of (1), torques over `size` [N]."""
        return float(np.abs(self.left / np.repeat([1.0, self.size], 3)).max())

    @property
    def settled(self) -> Array:
        """Forces in the contacts' frames once the object has moved into balance, (k, 3) [N]."""
        return self.local_squeeze + self.response @ self.left

    @property
    def balanced(self) -> bool:
        """Whether the squeeze balances, to within `SQUEEZE_BALANCED`."""
        total = float(np.linalg.norm(self.squeeze, axis=1).sum())
        return self.imbalance <= SQUEEZE_BALANCED * total

    @cached_property
    def frames(self) -> Array:
        """Columns (normal, tangent, tangent) of each contact, (k, 3, 3)."""
        return contact_frames(self.normals)

    @cached_property
    def size(self) -> float:
        """The longest arm [m], which makes torques comparable with forces."""
        return float(np.linalg.norm(self.arms, axis=1).max()) or 1.0

    @cached_property
    def elastic_stiffness(self) -> Array:
        """K of (5), (6, 6) [N/m, N, N m]: what the springs alone resist."""
        W = self.maps
        return (W @ self.stiffness @ W.transpose(0, 2, 1)).sum(axis=0)

    @cached_property
    def geometric_stiffness(self) -> Array:
        """What a squeeze adds to the springs' stiffness, (6, 6) [N m]: K_g of (5)."""
        return self.rolling_stiffness

    @cached_property
    def rolling_stiffness(self) -> Array:
        """K_g of (5), (6, 6) [N m]: what the squeeze adds because contacts move with the object."""
        reach = self.arms + self.tip_radius_m[:, None] * self.normals  # s_i
        total = np.zeros((WRENCH, WRENCH))
        along = np.einsum("ki,ki->", reach, self.squeeze)
        total[3:, 3:] = along * np.eye(3) - np.einsum("ki,kj->ij", reach, self.squeeze)
        return total

    @property
    def grasp_stiffness(self) -> Array:
        """Wrench that the grip resists a small motion with, per motion: K + K_g, (6, 6)."""
        return self.elastic_stiffness + self.geometric_stiffness

    @property
    def least_stiffness(self) -> float:
        """Smallest eigenvalue of the symmetric part of K + K_g, torques over `size` [N/m].

        The grip is stable as executed where it is positive.
        """
        return float(np.linalg.eigvalsh(0.5 * (self._scaled + self._scaled.T))[0])

    @property
    def stable(self) -> bool:
        """Whether the object returns after a small push while no contact slips."""
        return self.least_stiffness > STIFF * float(np.linalg.norm(self._scaled, 2))

    @cached_property
    def force_changes(self) -> Array:
        """Change of each contact force per motion of the object by (3), (k, 3, 6), world axes."""
        return -self.stiffness @ self.maps.transpose(0, 2, 1)

    @cached_property
    def _scaled(self) -> Array:
        """K + K_g with torques and turns in units of the size, (6, 6) [N/m]."""
        scale = np.repeat([1.0, 1.0 / self.size], 3)
        return scale[:, None] * self.grasp_stiffness * scale

    @cached_property
    def response(self) -> Array:
        """A_i of (6): change of each contact force, in its frame, per load wrench, (k, 3, 6).

        Raises:
            InputError: The grip has no stiffness against some motion.
        """
        turned = np.zeros((len(self.arms), 3, WRENCH))
        turned[:, :, 3:] = [cross_matrix(force) for force in self.squeeze]
        moved = turned + self.force_changes
        turned_back: Array = self.frames.transpose(0, 2, 1)
        return turned_back @ moved @ self.compliance

    @cached_property
    def compliance(self) -> Array:
        """Small motion (translation, turn) per load wrench, (K + K_g)^-1, (6, 6).

        Raises:
            InputError: The grip has no stiffness against some motion.
        """
        values = np.linalg.svd(self._scaled, compute_uv=False)
        if not values[-1] > STIFF * values[0]:
            raise InputError(
                "the grip has no stiffness against some motion, as two fingers have none against "
                "turns about their line; use other contacts, or less squeeze"
            )
        units = np.diag(np.repeat([1.0, 1.0 / self.size], 3))
        inverse = np.asarray(np.linalg.inv(self._scaled), dtype=np.float64)
        return units @ inverse @ units

    @cached_property
    def maps(self) -> Array:
        """W_i of (5), (k, 6, 3): from a force at each arm to its wrench."""
        return grasp_map(self.arms).reshape(WRENCH, -1, 3).transpose(1, 0, 2)

    @cached_property
    def local_maps(self) -> Array:
        """W_i F_i: from a force along the axes of each contact to its wrench, (k, 6, 3)."""
        return self.maps @ self.frames

    @property
    def local_squeeze(self) -> Array:
        """The squeeze in the frames of the contacts, (k, 3) [N]: normal, tangent, tangent."""
        return np.einsum("kij,ki->kj", self.frames, self.squeeze)


def grip(
    body: Polyhedron,
    contacts: Grasp | Iterable[Contact],
    friction: ArrayLike,
    squeeze: ArrayLike,
    *,
    stiffness: ArrayLike = STIFFNESS_N_PER_M,
    tip_radius_m: ArrayLike = TIP_RADIUS_M,
) -> Grip:
    """Squeeze an object with fingertips on springs, whose commands then stay as they are.

    Args:
        body: The object, whose centre of mass torques and turns are about.
        contacts: A grasp, or contacts, at least two.
        friction: Coulomb coefficient, one for all contacts or one each.
        squeeze: Contact forces at rest, on the object, (k, 3) [N]; they must balance.
        stiffness: Stiffness of the fingertips' springs [N/m]: one number, one each, or a symmetric
            matrix each, (k, 3, 3).
        tip_radius_m: Radius of the fingertips [m], one for all or one each; zero for points.

    Raises:
        InputError: Shapes or ranges are wrong, or the squeeze does not balance.
    """
    loose = unsqueezed(body, contacts, friction, stiffness=stiffness, tip_radius_m=tip_radius_m)
    built = replace(loose, squeeze=squeeze)
    if not built.balanced:
        total = float(np.linalg.norm(built.squeeze, axis=1).sum())
        raise InputError(
            f"the squeeze must balance: a wrench of {built.imbalance:.3g} N is left, of "
            f"{total:.3g} N in all; take it from best_squeeze, or from the forces of a witness"
        )
    return built


def unsqueezed(
    body: Polyhedron,
    contacts: Grasp | Iterable[Contact],
    friction: ArrayLike,
    *,
    stiffness: ArrayLike,
    tip_radius_m: ArrayLike,
) -> Grip:
    """Build a grip that does not push yet (see `grip`)."""
    check_body(body)
    if isinstance(contacts, Grasp):
        check_on_faces(body, contacts)
        points, units = contact_arrays(contacts, None)
    else:
        points, units = contact_arrays(*stacked(listed_contacts(contacts, "contacts")))
    count = len(points)
    arms, idle = points - body.center_of_mass, np.zeros((count, 3))
    radii = frozen_each(tip_radius_m, count, "tip_radius_m")
    mu = contact_frictions(friction, count)
    return Grip(arms, units, mu, idle, springs(stiffness, count), radii)


def check_grip(value: Grip) -> None:
    """Refuse a value that is not a grip, or is one that was tampered with."""
    if not instance(value, Grip, "grip", "gc.grip makes one").is_sound():
        raise InputError("grip must be as gc.grip makes it; its fields are not those of contacts")
