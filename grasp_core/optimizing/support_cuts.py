"""Proves that no four contacts on given faces reach a threshold, by asking who answers each twist.

Solved: given a threshold t, a proof that a measure of any four contacts on the pieces of faces is
below t: the Ferrari-Canny quality (`l1`, exact circular cones, torques over the object's radius, as
`ferrari_canny` measures it), or the largest resisted multiple of other loads (see `measures`).
Several contacts may be on one piece.

Derivation. A contact at x answers the twist y = (v, w) with the support of its cone,

    s(y, x) = n.u + mu |u - (n.u) n|,   u = v + w x x,                                  (1)

and contacts x_1 ... x_4 reach the measure t if and only if for every y some contact has
s(y, x_i) >= t d(y), with the demand d of the loads, (1) of `measures`: the support of the hull of
the contacts' cones is the largest of theirs. Let a(y) = t d(y) be what an *answer* is. For the
Ferrari-Canny quality d(y) = |y|, and a(y) = t is asked of twists with |y| >= 1. Let finger i be
known to be in the union of convex polygons K_ip, one for each piece p.

* *Ask.* A finger whose polygons have s < a at all corners cannot answer y, as s is convex in x. One
  of the others does. For each of them there is a child in which its polygons are cut to where it
  answers. No finger left: no child, the node is refuted.
* *Cut.* {x in K : s >= a} lies in the hull of the corners that reach a and of a point on each edge
  between such a corner and one that does not, at which s < a still: what is cut off beyond a chord
  between two such points is the hull of points with s < a.                            (2)
* *Divide.* A finger is on one side of a line or on the other, or on one of two sets of pieces.
* *Fresh fingers.* Contacts can be numbered as one likes. While some fingers have had no part in
  anything, their polygons are equal, and one child is enough for an answer from any of them.

A tree whose leaves are all refuted is a proof. It names the twists and lines, not the polygons,
which follow from them.

Rounding. The proof is replayed in doubles. With coordinates and twists of size one or two, a corner
is off the line or edge it should be on by less than 2e-15, a support computed is off by less than
4e-15 (1 + mu), and s changes by at most (1 + mu) per unit of distance. By induction over the nodes
above, a point that answers all questions with s >= a + (1 + mu) k e, after k cuts of error
e < 4e-15, is within k e of the polygons of its node: its nearest point in the polygon before a cut
has s >= a still, so that (2) leaves it in. With at most `MOST_CUTS` cuts above any node,

    measure < t + (1 + mu) * ROUNDING                                                     (3)

has room for more than ten times this. Twists of length 1 - 1e-12 are taken for units.

Other measures. Twists may ask for little or nothing, d(y) = 0, so that a larger t does not make
room for rounding. Here less is an answer,

    a(y) = t d(y) - (1 + mu) * ROUNDING,                                                  (4)

for twists with |y| <= 1 + 1e-12, and contacts that reach t answer all questions with the room that
the induction needs: the bound is t itself. The product t d(y) is rounded as well, once for each
twist, as its error does not move points. With L the longest load, t d(y) <= t L, and the products
and sums of six numbers in it are off by less than 1e-15 t L. A wrench of forces with normal parts
of sum one is shorter than 8 (1 + mu), with coordinates up to two, so that only t L <= 8 (1 + mu)
need be considered, and a(y) is off by less than 1e-14 (1 + mu), a hundred-thousandth of the room.

Search. A search must not depend on last digits, so it works with numbers on a grid, at most 7e-12
from those of the proof (see rule 4 of `solvers.ties`). With coordinates of at most two its points
are off by less than 1e-10, its supports by 2e-10 (1 + mu), and t d(y) of a task by 4e-10 (1 + mu).
It refutes a threshold that is lower by `SEARCHED_BELOW`, more than all of these, so that what
answers in the replay answers in the search. No proof rests on that: the replay decides.

Symmetries. See `contact_places`: contacts can be moved by a symmetry, at the cost of its error. It
takes the place of rounding in (3) and (4): `INEXACT` is added to `MEASURE_ROUNDING`.

Files. A proof about a whole object is kept as an npz file, which needs no pickles. Its arrays are
those of `CutTree` and of its `Grounds`, by name, and three more: `format` is the text "graspproof
cut tree", `bound` is what the proof shows, for readers that do not compute it, and `schema` is 1
for the Ferrari-Canny quality. For other measures it is 2, and two arrays say which loads count:
`measure`, a text, and `loads`, those of a task.
"""

import io
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from annotated_types import Len
from numpy.typing import NDArray

from grasp_core.allowed_values import FrictionOrZero
from grasp_core.arrays import Array, Indices, Shape
from grasp_core.compiled import compiled
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.files.text_files import read_bytes, write_parts
from grasp_core.optimizing.contact_places import REPLAY, Grounds, first_nodes, fitting
from grasp_core.quality.measures import FERRARI_CANNY, Measure
from grasp_core.values import FINGERS

MEASURE_ROUNDING = 1e-9
"""How far rounding can lift a measure above the threshold, over 1 + mu: the derivation needs less
than a tenth of it."""
MOST_CUTS = 10_000
"""Largest number of cuts above a node: hundreds are usual, and (3) is derived for no more."""
SEARCHED_BELOW = 1e-9
"""How far below its threshold a proof is searched for, over 1 + mu, so that replaying it, with
other roundings, meets no case that is just decided the other way."""
INEXACT = 1e-7
"""How far errors of symmetries can lift a measure, over 1 + mu (see `contact_places`)."""
TWIST_SLACK = 1e-12
"""How far unit twists may be from length one: their lengths are rounded by less than 1e-15, and a
wrench is shorter than 8 (1 + mu), so that a support is off by a hundredth of `MEASURE_ROUNDING` at
most."""
LONGEST_TWIST = 2.0
"""Longest twist for the Ferrari-Canny quality, the size for which rounding is bounded."""
LEAST_THRESHOLD, MOST_THRESHOLD = 1e-6, 1e3
"""Thresholds that are proved, times the longest load: a thousand times what rounding takes, and
more than normal forces of sum one reach on contacts with coordinates up to two, at any friction
below a hundred."""
LONGEST_WRENCH = 8.0
"""More than the length of any wrench of forces with normal parts of sum one, over 1 + mu."""
LARGEST_LINE = 1e3
"""Largest number in a line, of which a search makes none above 128: no product of it overflows."""


class Slack(NamedTuple):
    """What a proof leaves for rounding and for errors of symmetries."""

    raised: float  # how far its bound is above the threshold that it refutes, by (3)
    lowered: float  # how far below threshold times demand supports are answers, by (4)

    @classmethod
    def of(cls, friction: float, maps: int, measure: Measure, more: float = 0.0) -> "Slack":
        """Return the slack of proofs about a measure."""
        lost = MEASURE_ROUNDING + (INEXACT if maps > 1 else 0.0)
        slack = (1.0 + friction) * lost + (1.0 + friction) * more
        return cls(slack, 0.0) if measure.is_usual else cls(0.0, slack)


@declared
class CutTree(Declared):
    """A proof that a measure of contacts on the pieces of faces is below a bound."""

    grounds: Grounds
    """Where contacts may be, at unit size."""
    friction: FrictionOrZero
    maps: Annotated[Array, Shape(None, 3, 3), Len(1)]
    """Symmetries that are used, matrices about the centre of mass, the identity first, (g, 3, 3).
    """
    threshold: float
    """The multiple of the loads, or the Ferrari-Canny quality [N], that the tree refutes."""
    deeds: Annotated[Indices, Shape("n", whole=True), Len(1)]
    """What is done at each node, parents before their children, the whole subtree of a child before
    the next child, (n,): the sum of 2**i over fingers i that may answer; 16 + i if finger i is on
    some pieces or others; 32 + i if it is on one side of a line or the other."""
    asked: Annotated[Indices, Shape("n", whole=True)]
    """Place of the twist, or of the line, (n,)."""
    twists: Annotated[Array, Shape(None, 6)]
    """Twists, with torques over the object's radius, (m, 6)."""
    lines: Annotated[Array, Shape(None, 3)]
    """Rows (a, b, c): first a x + b y <= c in the piece's plane, then >=; for pieces (k, 0, 0),
    first those below k, then the others, (l, 3)."""
    measure: Measure = FERRARI_CANNY
    """The loads whose largest resisted multiple is bounded."""
    owners: Annotated[Indices, Shape(None, whole=True)] | None = None
    """The finger that may be on each piece, (p,), where each finger has pieces of its own; None
    where any finger may be on any piece."""

    @property
    def bound(self) -> float:
        """Return the multiple, or the quality [N], that no contacts exceed."""
        return self.threshold + self.slack.raised

    @property
    def slack(self) -> Slack:
        """Return what the bound, and the answers to twists, leave for rounding."""
        return Slack.of(self.friction, len(self.maps), self.measure)

    def verify(self) -> bool:
        """Replay the proof without the search, from the pieces, in plain arithmetic."""
        with np.errstate(all="ignore"):
            return self.is_sound() and self._is_fit() and bool(self._replayed())

    def _is_fit(self) -> bool:
        """Return whether all numbers are of sizes for which (3) and (4) are derived."""
        if not self._has_fitting_threshold():
            return False
        lengths = np.linalg.norm(self.twists, axis=1)
        fits = lengths.min(initial=1.0) >= 1.0 - TWIST_SLACK
        longest = LONGEST_TWIST if self.measure.is_usual else 1.0 + TWIST_SLACK
        fits = fits and lengths.max(initial=1.0) <= longest
        fits = fits and np.abs(self.lines).max(initial=0.0) <= LARGEST_LINE
        alone = len(self.maps) == 1
        if self.owners is not None:  # each piece has one, and each finger a piece
            owned = len(self.owners) == len(self.grounds.counts)
            owned = owned and set(self.owners.tolist()) == set(range(FINGERS))
            return bool(fits) and alone and owned
        return bool(fits) and (alone or fitting(self.maps, self.grounds, self.measure))

    def _has_fitting_threshold(self) -> bool:
        if self.measure.is_usual:
            return LEAST_THRESHOLD <= self.threshold <= MOST_THRESHOLD
        size = self.measure.size
        most = LONGEST_WRENCH * (1.0 + self.friction) / size
        return LEAST_THRESHOLD / size <= self.threshold <= most

    def _replayed(self) -> bool:
        kernel, grounds = compiled(REPLAY), self.grounds
        nodes = first_nodes(grounds, self.maps, self.owners)
        # (4), or the threshold itself
        answers = self.threshold * self.measure.demands(self.twists) - self.slack.lowered
        return kernel.replay(
            kernel.Pieces(grounds.normals, grounds.origins, grounds.frames, self.friction),
            *nodes, self.deeds.astype(np.int64), self.asked.astype(np.int64),
            np.array(self.twists), answers, np.array(self.lines), MOST_CUTS,
        )  # fmt: skip


USUAL_SCHEMA, OTHER_SCHEMA, FORMAT = 1, 2, "graspproof cut tree"
"""Schema of files for the Ferrari-Canny quality, and for other measures; what both say they are."""
MOST_PROOF_BYTES = 2**30
OF_LOADS = ("measure", "loads")
OF_GROUNDS = tuple(each.name for each in fields(Grounds))
OF_TREE = tuple(each.name for each in fields(CutTree)
                if each.name not in {"grounds", "measure", "owners"})  # fmt: skip
SMALL_TYPES = {"deeds": np.uint8, "asked": np.int32, "faces": np.int32, "counts": np.int32}
"""Types that hold the whole numbers of the tree in less room."""


def write_proof(path: Path, proof: CutTree) -> Path:
    """Write a proof to an npz file."""
    if proof.owners is not None:
        raise InputError(
            f"{path}: expected a proof about all contacts of an object, as best_grasp makes, got "
            "one about four faces, which has no file"
        )
    arrays: dict[str, Any] = {name: getattr(proof.grounds, name) for name in OF_GROUNDS}
    arrays |= {name: getattr(proof, name) for name in OF_TREE}
    arrays |= {name: arrays[name].astype(kind) for name, kind in SMALL_TYPES.items()}
    arrays |= {"format": FORMAT, "bound": proof.bound, "schema": USUAL_SCHEMA}
    if not proof.measure.is_usual:
        arrays |= {
            "schema": OTHER_SCHEMA,
            "measure": proof.measure.name,
            "loads": proof.measure.loads,
        }
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return write_parts(path, [stream.getvalue()])


def read_proof(path: Path) -> CutTree:
    """Read a proof that `write_proof` has written; `CutTree.verify` then checks what it claims."""
    arrays = _arrays(path)
    schemas = [
        kind for kind in (USUAL_SCHEMA, OTHER_SCHEMA) if np.array_equal(arrays["schema"], kind)
    ]
    if str(arrays["format"]) != FORMAT or not schemas:
        raise InputError(
            f"{path}: expected the text {FORMAT!r} and schema {USUAL_SCHEMA} or {OTHER_SCHEMA}; "
            "write it again"
        )
    with about(path):
        grounds = Grounds(**{name: arrays[name] for name in OF_GROUNDS})
        measure = FERRARI_CANNY
        if schemas == [OTHER_SCHEMA]:
            name: Any = str(arrays["measure"])
            measure = Measure(name, arrays["loads"])
            if measure.is_usual:
                raise InputError(
                    f"expected measure 'weight' or 'task' with schema {OTHER_SCHEMA}, got {name}"
                )
        # arrays of no axes become numbers
        parts: dict[str, Any] = {name: arrays[name][()] for name in OF_TREE}
        proof = CutTree(grounds, measure=measure, **parts)
        if not np.array_equal(arrays["bound"], proof.bound):
            raise InputError(f"bound must be the {proof.bound:.17g} that the threshold proves")
    return proof


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    data = read_bytes(path, MOST_PROOF_BYTES)
    wanted = (*OF_GROUNDS, *OF_TREE, "schema", "format", "bound")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            claimed = sum(each.file_size for each in archive.infolist())
        if claimed > MOST_PROOF_BYTES:
            raise InputError(f"{path}: its arrays take {claimed} bytes, over {MOST_PROOF_BYTES}")
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            found = {name: archive[name] for name in wanted}
            if np.array_equal(found["schema"], OTHER_SCHEMA):
                found |= {name: archive[name] for name in OF_LOADS}
            return found
    except InputError:
        raise
    except Exception as error:  # a damaged file can make zipfile and numpy raise anything
        raise InputError(
            f"{path}: expected an npz file with the arrays {', '.join(wanted)}, got: {error!r}"[
                :300
            ]
        ) from error
