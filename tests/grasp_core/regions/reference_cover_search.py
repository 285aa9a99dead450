"""Reference for the compiled search of covers: the same game level by level in NumPy.

It does not look for open choices, and sums in the order of a library, so that rounding decides
some ties differently.
"""

import numpy as np

from grasp_core.regions.proof import EDGES, LEAF, TWIST, TwistCover, halves, orthants
from grasp_core.regions.sites import AHEAD, ANSWERS, CLEAR_OF_CONE, EVEN, ROUNDS


def reference_cover(sites, axes, cones):
    """The cover of contacts at sites, or None where more cones would be needed."""
    found = _by_levels(sites.on_grid(), axes, max(cones, 1 << TWIST))
    if found is None:
        return None
    codes, forces = found
    return TwistCover(axes, codes, np.einsum("kij,mkj->mki", sites.frames, forces))


def _by_levels(sites, axes, cones):
    """Codes of all cones, and forces along the frames of the cones that are not cut."""
    level, codes, forces = orthants(), [], []
    total = 0
    while len(level):
        total += len(level)
        if total > cones:
            return None
        covered, weights, found = _Game(level, axes, sites).play()
        code = np.where(covered, LEAF, _edges_to_cut(level, weights))
        codes.append(code)
        forces.append(found[covered])
        # (4): cones without forces go on to the next level in halves
        level = halves(level[~covered], code[~covered])
    return np.concatenate(codes), np.concatenate(forces)


class _Game:
    """The game of forces against rays, on many cones at once."""

    def __init__(self, cones, axes, sites):
        twists = cones @ axes
        twists /= np.linalg.norm(twists, axis=2, keepdims=True)
        a, b = twists[:, :, None, :3], twists[:, :, None, 3:]
        self.velocity = np.einsum("mrki,kij->mrkj", a + np.cross(b, sites.points), sites.frames)
        self.turning = np.einsum("mri,kij->mrkj", twists[..., 3:], sites.frames)
        self.sites, self.most = sites, sites.friction * (1.0 - CLEAR_OF_CONE)
        self.clear = sites.clear()

    def play(self):
        """Cones with forces found, (m,), weights of rays, (m, r), and forces, (m, k, 3)."""
        m, r, k = self.velocity.shape[:3]
        forces, covered, lost = np.zeros((m, k, 3)), np.zeros(m, np.bool_), np.zeros(m, np.bool_)
        weights, regrets = np.full((m, r), 1.0 / r), np.zeros((m, r))
        rows = np.arange(m, dtype=np.int64)
        for turn in range(ROUNDS):
            sums, answers = self._answers(weights)
            contact = sums.argmax(axis=1)
            # no answer has power on these weights, so no forces cover the cone
            lost |= ~covered & (sums.max(axis=1) <= AHEAD)
            going = ~(covered | lost)
            if not going.any():
                break
            powers = self._least(answers)[0][rows, :, contact]
            # later answers count more
            played = np.zeros((m, k, 3))
            played[rows, contact, 0] = turn + 1.0
            played[rows, contact, 1:] = (turn + 1.0) * answers[rows, contact]
            forces[going] += played[going]
            along = forces[..., :1]
            tangential = forces[..., 1:] / np.where(along > 0.0, along, 1.0)
            together = np.einsum("mrk,mk->mr", self._least(tangential)[0], along[..., 0])
            # (2): h > 0 on every ray, by more than rounding to the grid may cost
            covered |= going & (together.min(axis=1) > along[..., 0] @ self.clear)
            # weight for the rays that have lacked power, counting the last round twice
            regret = (weights * powers).sum(axis=1, keepdims=True) - powers
            regrets = np.where(going[:, None], np.maximum(regrets + regret, 0.0), regrets)
            ahead = np.maximum(regrets + regret, 0.0)
            totals = ahead.sum(axis=1, keepdims=True)
            ahead = np.where(totals > 0.0, ahead / np.where(totals > 0.0, totals, 1.0), 1.0 / r)
            weights = np.where((going & ~covered)[:, None], ahead, weights)
        return covered, weights, forces

    def _answers(self, weights):
        """Weighted sums of least powers, (m, k), and good tangential parts of forces, (m, k, 2)."""
        mean = np.einsum("mr,mrkj->mkj", weights, self.turning)
        tried = _allowed(mean[..., 1:], mean[..., :1], self.most)
        best, found, slopes = np.full(mean.shape[:2], -np.inf), tried, np.zeros_like(tried)
        for turn in range(ANSWERS):
            least, slope = self._least(tried)
            sums = np.einsum("mr,mrk->mk", weights, least)
            found = np.where((sums > best)[..., None], tried, found)
            best = np.maximum(best, sums)
            slopes += (np.einsum("mr,mrkj->mkj", weights, slope) - slopes) / (turn + 1.0)
            tried = _longest(slopes, self.most)
        return best, found

    def _least(self, tangential):
        """Least powers of forces over sites, (m, r, k), and slopes in the forces there."""
        v, b, sites = self.velocity, self.turning, self.sites
        g = tangential[:, None]
        across = b[..., 1:] - b[..., :1] * g
        lever = np.stack([-across[..., 1], across[..., 0]], axis=-1)
        places = np.empty_like(lever)
        # a corner of the polygon, then (3) for the disc around it, then a side of the prism
        for i, corners in enumerate(sites.corners):
            lowest = (lever[:, :, i] @ corners.T).argmin(axis=2)
            places[:, :, i] = corners[lowest]
        lengths = np.linalg.norm(lever, axis=-1, keepdims=True)
        places -= sites.radii[:, None] * lever / np.where(lengths > 0.0, lengths, 1.0)
        height = g[..., 0] * b[..., 2] - g[..., 1] * b[..., 1]
        out = -sites.depths * np.where(height > 0.0, 1.0, -1.0)
        least = v[..., 0] + (v[..., 1:] * g).sum(axis=-1) + (lever * places).sum(axis=-1)
        around = np.stack([-places[..., 1], places[..., 0]], axis=-1) * b[..., :1]
        off = np.stack([b[..., 2], -b[..., 1]], axis=-1) * out[..., None]
        return least + out * height, v[..., 1:] + around + off


def _longest(slopes, most):
    """Tangential parts in the given directions, as long as friction allows."""
    lengths = np.linalg.norm(slopes, axis=-1, keepdims=True)
    return most[:, None] * slopes / np.where(lengths > 0.0, lengths, 1.0)


def _allowed(parts, along, most):
    """Tangential parts over normal parts, shortened to what friction allows."""
    short = np.linalg.norm(parts, axis=-1, keepdims=True) < np.abs(along) * most[:, None]
    divided = parts / np.where(short, along, 1.0)
    return np.where(short, divided, _longest(parts * along, most))


def _edges_to_cut(cones, weights):
    """Number of the edge to cut of each cone, long and between rays that weigh much, (m,)."""
    units = cones / np.linalg.norm(cones, axis=2, keepdims=True)
    ends = np.array(EDGES)
    gaps = units[:, ends[:, 0]] - units[:, ends[:, 1]]
    heavy = (weights[:, ends[:, 0]] + EVEN) * (weights[:, ends[:, 1]] + EVEN)
    return ((gaps**2).sum(axis=2) * heavy).argmax(axis=1)
