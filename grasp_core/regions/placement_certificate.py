"""Bounds from below how likely a grasp is closed when object and fingers are not where planned.

Solved: an object is moved by a Gaussian error, a translation t and a turn w about its centre o, and
each finger by a Gaussian shift e_i across its direction n_i, the planned normal into the object.
Fingers come along their directions until they meet the object. Friction mu is known, or Gaussian.
How likely are the contacts in force closure, at least?

Where fingers meet. Let d_i = x_i - o for the planned contacts x_i, and R the turn. Then face i has
the normal n'_i = R n_i, and the finger meets its plane at

    x_i + e_i + s_i n_i,    s_i = (n_i.d_i - n'_i.(d_i + e_i - t)) / n_i.n'_i.              (1)

However far the object moves, a contact stays on its finger's line. It slides along that line, and
its normal turns by at most |w|. So a cover (`regions_certificate`) over the prisms

    K_i = {x_i + e + s n_i :  |e| <= E, |s| <= S_i}  with normals n_i and friction m          (2)

proves closure for all such motions at once, where each |e_i| <= E and |s_i| <= S_i, and where

    |w| + atan m <= atan mu,                                                                (3)

since a force within atan m of n_i is then within atan mu of n'_i. Where the true surface leans by
up to a `lean` against its plane, that is added to |w|; where it is up to a `depth` off its plane,
fingers meet it within depth / cos T along their lines and depth tan T beside them. The polygons of
`certify_regions` prove less of this: they let the contacts move on their faces independently, while
one motion of the object moves all of them alike, which hardly changes the wrenches between them.

Series. The finger meets its face where E_k.y <= b_k, with unit edge normals E_k in the plane of the
face, and with y = R'(d_i + e_i - t + s_i n_i) - d_i. Write a = w x n_i. To second order

    s_i n_i.n'_i = n_i.t - a.d_i          - w x a.d_i / 2 + a.(t - e_i),                    (4)
    E_k.y = E_k.(e_i - t - w x d_i)       + E_k.(w x (w x d_i) / 2 - w x (e_i - t))
                                          - (n_i.t - a.d_i) (E_k.a),                         (5)

and |s_i| <= S_i if |s_i n_i.n'_i| + S_i |w|^2 / 2 <= S_i, since n_i.n'_i >= 1 - |w|^2 / 2. What R
has from second order on is at most |w|^2 / 2, and from third order on |w|^3 / 6. With |w| <= T <= 1
and k = 1 / cos T, all that (4) and (5) leave out is then at most |w|^2 times

    |w| |d_i| (2/3 + k (1 + T) / 2) + (|t| + |e_i|) (3/2 + k (1 + T) / 2).                  (6)

Chance. In unit normal variables z, (4) and (5) are sigma g + z'Hz, with g normal; and (6) is part
of H, once t, w and e_i are bounded by their `LARGEST_DEVIATIONS`. Where w = 0 nothing is left of
z'Hz, so at most three eigenvalues of H are positive, as w has three coordinates. Let l be the
largest, or zero if that is more. Then z'Hz is at most l times the squared length of z in the space
of three vectors and the gradient of g: g^2, and at most three more coordinates, which do not depend
on g. So a limit b is broken with at most the chance that

    sigma g + l (g^2 + q) > b,    q of the chi-square law of 3 variables,                    (7)

which rises with q, so that the largest values on some intervals of q bound its mean from above.
What is bounded in the end is the sum of the chances of all failures.
"""

import importlib
import math
from typing import Annotated, Any

import numpy as np

from grasp_core.allowed_values import Friction, NotNegative, Share
from grasp_core.arrays import Amount, Array, Point, Polygon, Shape, cross
from grasp_core.closure.contacts import unit_size
from grasp_core.closure.decision import decided_at_once
from grasp_core.closure.proofs import ContactCones
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import circle, convex_polygon, plane_frame
from grasp_core.regions.regions_certificate import PLACE_SLACK, TwistCover
from grasp_core.values import FINGERS

ESTIMATE_DRAWS = 2000
ROUNDING_CHANCE = 1e-9
LARGEST_DEVIATIONS = 4.5
"""Largest motions that count, in their largest deviations: a chance of 1.5e-4 for each of t, w."""
LARGEST_CLOSED_TURN = 1.0
"""Largest turn that may count as closed [rad]."""
DISC_SIDES = 16
TAIL_CHANCES = np.append(np.exp2(np.arange(-1.0, -160.0, -1.0) / 4.0), 0.0)
"""Chances of values above the ends of the intervals that a law is divided into."""
MASS = -np.diff(TAIL_CHANCES, prepend=1.0)
"""Chances of the intervals."""


@declared
class Misplacement(Declared):
    """How far object, fingers and friction may be off what was planned: Gaussian errors."""

    covariance: Annotated[Array, Shape(6, 6)]
    """Covariance of the object's translation and then its turn about its centre [m, rad]."""
    contact_sigma: Amount
    """Standard deviation of each finger in each direction across its own [m]."""
    friction: Friction
    """Mean of the Coulomb coefficient, which all contacts share."""
    friction_sigma: NotNegative
    """Standard deviation of the Coulomb coefficient."""

    def _check_together(self) -> None:
        values = np.linalg.eigvalsh(self.covariance)
        if (
            not (self.covariance == self.covariance.T).all()
            or values[0] < -ROUNDING_CHANCE * values[-1]
        ):
            raise InputError("covariance must be symmetric and have no negative eigenvalue")

    @property
    def root(self) -> Array:
        """A matrix A with A A' = covariance, (6, 6)."""
        values, vectors = np.linalg.eigh(self.covariance)
        return vectors * np.sqrt(np.maximum(values, 0.0))

    @property
    def turn(self) -> float:
        """Largest turn of the object that may count as closed, T [rad]."""
        return min(
            LARGEST_CLOSED_TURN, LARGEST_DEVIATIONS * float(np.linalg.norm(self.root[3:], 2))
        )


@declared
class PlacementProbability(Declared):
    """A proved lower bound of the chance that a grasp is closed wherever fingers meet the object.

    Fingers come along the planned normals, from at least their `slides` and at most twice the
    largest behind the planned contacts. The object does not move before all have come, and its
    errors, those of fingers and of friction do not depend on each other.
    """

    lower: Share
    """The chance of force closure is at least this."""
    off: Misplacement
    """The errors that are counted on."""
    center: Point
    """Centre of mass, about which the object turns [m]."""
    positions: Annotated[Array, Shape(FINGERS, 3)]
    """Planned contacts, (4, 3) [m]."""
    normals: Annotated[Array, Shape(FINGERS, 3, units=True)]
    """Planned unit normals into the object, (4, 3)."""
    landings: tuple[Polygon, Polygon, Polygon, Polygon]
    """Convex parts of the faces to which nothing is in the way, (k, 3) [m]."""
    lean: Amount
    """Largest angle between the true surface and the planes of the landings [rad]."""
    depth: Amount
    """Largest distance of the true surface from the planes of the landings [m]."""
    slides: Annotated[Array, Shape(FINGERS, least=0.0)]
    """How far contacts may slide along their fingers, S in (2), (4,) [m]."""
    shift: Amount
    """How far fingers may be beside their lines, E in (2) [m]."""
    least_friction: Friction
    """Friction of the cover, m in (2)."""
    cover: TwistCover
    """Proof that all contacts of (2) are closed, with lengths relative to `scale`."""
    origin: Point
    """Point about which torques are taken in the proof [m]."""
    scale: Amount
    """Length that the proof uses as its unit [m]."""

    def verify(self) -> bool:
        """Check again that the cover holds, and that the chance of closure is at least `lower`.

        Whoever has the object checks that `landings` are parts of faces with these `normals`, that
        no finger within `off.turn` of a normal meets another part first, that `lean` and `depth`
        are those of these faces, and that the object turns about `center`.
        """
        if not (self.is_sound() and self.off.is_sound() and self.scale > 0.0):
            return False
        with np.errstate(all="ignore"):
            if any(self.edges(i) is None for i in range(FINGERS)):
                return False
            friction = np.full(FINGERS, self.least_friction)
            proved = self.cover.verify(self._prisms(), self.normals, friction)
            return proved and self.lower <= bound(self)

    def edges(self, i: int) -> tuple[Array, Array] | None:
        """Return E, (k, 3), and b [m] of (5) for a landing; None if it is no convex polygon."""
        frame, arms = plane_frame(self.normals[i]), self.landings[i] - self.positions[i]
        size = float(np.abs(arms).max(initial=0.0))  # of no corners too
        flat = convex_polygon(arms @ frame / size, PLACE_SLACK)
        if flat is None or np.abs(arms @ self.normals[i]).max() > PLACE_SLACK * size:
            return None
        return flat.E @ frame.T, flat.b * size

    @property
    def estimate(self) -> float:
        """Share of some draws in which fingers meet their landings and are closed there.

        The draws are always the same. Fingers that meet the object beside their landings count as
        not closed, although they often are, so that more draws may be closed than this.
        """
        spatial: Any = importlib.import_module("scipy.spatial.transform")
        rng, n, d = np.random.default_rng(0), self.normals, self.positions - self.center
        moves = rng.normal(size=(ESTIMATE_DRAWS, 6)) @ self.off.root.T
        mu = self.off.friction + self.off.friction_sigma * rng.normal(size=ESTIMATE_DRAWS)
        R = spatial.Rotation.from_rotvec(moves[:, 3:]).as_matrix()
        frames = np.array([plane_frame(each) for each in n])
        beside = self.off.contact_sigma * rng.normal(size=(ESTIMATE_DRAWS, FINGERS, 2))
        arms = d + np.einsum("kij,mkj->mki", frames, beside) - moves[:, None, :3]
        # (1), before the object has moved
        turned = np.einsum("mij,kj->mki", R, n)
        leaning = np.einsum("mki,ki->mk", turned, n)
        slides = np.einsum("ki,ki->k", n, d) - np.einsum("mki,mki->mk", turned, arms)
        arms += (slides / leaning)[..., None] * n
        back = np.einsum("mji,mkj->mki", R, arms) - d
        there = (leaning > 0.0).all(axis=1) & (mu > 0.0)
        for i in range(FINGERS):
            E, b = self.edges(i) or (np.zeros((1, 3)), np.full(1, -1.0))
            there &= (back[:, i] @ E.T <= b).all(axis=1)
        if not there.any():
            return 0.0
        friction = np.repeat(mu[there, None], FINGERS, axis=1)
        cones = ContactCones.at(unit_size(arms[there])[0], turned[there], friction)
        return float(np.count_nonzero(decided_at_once(cones)[0])) / ESTIMATE_DRAWS

    def _prisms(self) -> list[Array]:
        """Return corners of prisms that hold (2), in the unit of the proof, (32, 3) each."""
        disc = self.shift / math.cos(math.pi / DISC_SIDES) * circle(DISC_SIDES)
        lengths = self.slides + self.depth / math.cos(self.off.turn)
        found = list[Array]()
        for x, n, length in zip(self.positions, self.normals, lengths, strict=True):
            rim = x + disc @ plane_frame(n).T - self.origin
            found.append(np.vstack([rim + length * n, rim - length * n]) / self.scale)
        return found


def bound(it: PlacementProbability) -> float:
    """Return a number that the chance of closure is not below, by (3) to (7)."""
    special: Any = importlib.import_module("scipy.special")
    failing = (
        chance_of_turning(it)
        + 2.0 * float(special.chdtrc(3, LARGEST_DEVIATIONS**2))
        + ROUNDING_CHANCE
    )
    if it.off.contact_sigma:
        failing += FINGERS * float(np.exp(-0.5 * np.square(it.shift / it.off.contact_sigma)))
    failing += float(_chances_beyond(*_limits(it), special).sum())
    return max(0.0, 1.0 - failing)


def chance_of_turning(it: PlacementProbability) -> float:
    """Bound the chance that (3) fails from above: by the least friction of each interval."""
    special: Any = importlib.import_module("scipy.special")
    mu = it.off.friction + it.off.friction_sigma * special.ndtri(TAIL_CHANCES[:-1])
    room = np.arctan(np.maximum(mu, 0.0)) - math.atan(it.least_friction) - it.lean
    turned = float(np.linalg.norm(it.off.root[3:], 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = special.chdtrc(3, (np.minimum(room, LARGEST_CLOSED_TURN) / turned) ** 2)
    return float(np.where(room > 0.0, turning, 1.0) @ MASS[:-1]) + float(MASS[-1])


def _limits(it: PlacementProbability) -> tuple[Array, Array, Array]:
    """Write (4) and (5) as g.z + z'Hz <= b: g (m, 8), H (m, 8, 8) and b (m,)."""
    off, T = it.off, it.off.turn
    k = (1.0 + T) / (2.0 * math.cos(T))
    farthest = LARGEST_DEVIATIONS * float(np.linalg.norm(off.root[:3], 2)) + it.shift
    linear, curved, limits = list[Array](), list[Array](), list[Array]()
    for i, (x, n, slide) in enumerate(zip(it.positions, it.normals, it.slides, strict=True)):
        d, (E, b) = x - it.center, it.edges(i) or (np.zeros((1, 3)), np.full(1, -1.0))
        # of t, w and e, (.., 9)
        sliding = np.concatenate([n, -cross(n, d), np.zeros(3)])
        Q = np.zeros((2 + len(E), 9, 9))
        Q[0, 3:6, 3:6] = 0.5 * (float(n @ d) * np.eye(3) - np.outer(n, d))
        Q[0, 3:6, :3], Q[0, 3:6, 6:] = _crossing(n), -_crossing(n)
        Q[1] = -Q[0]
        Q[2:, 3:6, 3:6] = 0.5 * (E[:, :, None] * d - (E @ d)[:, None, None] * np.eye(3))
        Q[2:, 3:6, :3], Q[2:, 3:6, 6:] = -_crossing(E), _crossing(E)
        Q[2:, :, 3:6] -= sliding[:, None] * cross(n, E)[:, None, :]
        left = T * float(np.linalg.norm(d)) * (2.0 / 3.0 + k) + farthest * (1.5 + k)  # (6)
        Q[:2, 3:6, 3:6] += 0.5 * slide * np.eye(3)
        Q[:, 3:6, 3:6] += left * np.eye(3)
        B = np.zeros((9, 8))
        B[:6, :6], B[6:, 6:] = off.root, off.contact_sigma * plane_frame(n)
        linear += [sliding @ B, -sliding @ B, np.hstack([-E, -cross(d, E), E]) @ B]
        curved.append(B.T @ (0.5 * (Q + Q.swapaxes(1, 2))) @ B)
        limits += [np.full(2, slide), b - it.depth * math.tan(T)]
    return np.vstack(linear), np.vstack(curved), np.concatenate(limits)


def _crossing(v: Array) -> Array:
    """Return the matrices that take u to v x u, (..., 3, 3)."""
    return cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)


def _chances_beyond(g: Array, H: Array, b: Array, special: Any) -> Array:
    """Bound the chances that g.z + z'Hz <= b fails, one for each row, from above by (7)."""
    sigma = np.linalg.norm(g, axis=1)[:, None]
    top = np.maximum(np.linalg.eigvalsh(H)[:, -1:], 0.0)
    left = b[:, None] - top * special.chdtri(3, TAIL_CHANCES[:-1])
    # sigma g + l g^2 > left beyond one root, and before the other
    square = sigma**2 + 4.0 * top * left
    roots = sigma + np.sqrt(np.maximum(square, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = special.ndtr(-2.0 * left / roots)
        before = np.where(top > 0.0, special.ndtr(-roots / (2.0 * top)), 0.0)
    known = np.where((sigma == 0.0) & (top == 0.0) & (left >= 0.0), 0.0, 1.0)
    each = np.where(square > 0.0, np.minimum(beyond + before, 1.0), known)
    return each @ MASS[:-1] + MASS[-1]
