"""What is claimed of squeezes and payloads: by the springs' own equations, grids and programs."""

import numpy as np
from scipy.optimize import linprog

from tests.tampering.exact_closure import UNIT, contacts_make_sense, tangents, unit_arms
from tests.tampering.wrench_bounds import largest_multiple, torques_of

GRAVITY = 9.80665
TURNS = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
CIRCLE = np.column_stack([np.cos(TURNS), np.sin(TURNS)])


def sensible(g):
    """Whether a grip is one, with a squeeze that balances and returns after every small push."""
    if not contacts_make_sense(g.arms, g.normals, g.friction):
        return False
    symmetric = (
        np.abs(g.stiffness - g.stiffness.transpose(0, 2, 1)).max() <= 1e-8 * g.stiffness.max()
    )
    positive = np.linalg.eigvalsh(g.stiffness).min() > 0.0 and g.tip_radius_m.min() >= 0.0
    size = np.linalg.norm(g.arms, axis=1).max() or 1.0  # tampered arms may all be zero
    torque = np.cross(g.arms, g.squeeze).sum(axis=0) / size
    left = np.abs(np.append(g.squeeze.sum(axis=0), torque)).max()
    balanced = left <= 2e-6 * np.linalg.norm(g.squeeze, axis=1).sum()
    S = stiffness(g)
    scale = np.repeat([1.0, 1.0 / size], 3)
    stable = np.linalg.eigvalsh(scale[:, None] * (S + S.T) * scale).min() > 0.0
    return bool(symmetric and positive and balanced and stable)


def moved(g):
    """Change of each contact force, and of its arm, under the six unit motions, (6, k, 3) each."""
    forces, arms = [], []
    for d, t in zip(*np.split(np.eye(6), 2, axis=1), strict=True):
        tip = d + np.cross(t, g.arms)
        forces.append(-np.einsum("kij,kj->ki", g.stiffness, tip))
        arms.append(np.cross(t, g.arms) + g.tip_radius_m[:, None] * np.cross(t, g.normals))
    return np.array(forces), np.array(arms)


def stiffness(g):
    """Minus the change of the contacts' wrench under each unit motion, in columns."""
    forces, arms = moved(g)
    torque = np.cross(g.arms, forces) + np.cross(arms, g.squeeze)
    return -np.hstack([forces.sum(axis=1), torque.sum(axis=1)]).T


def responding(g, loads):
    """Forces (normal, tangents) of the squeeze, what the offset adds, and what unit loads add."""
    frames = np.array([np.column_stack([n, tangents(n)]) for n in g.normals])
    forces, _ = moved(g)
    turned = np.array([np.cross(t, g.squeeze) for t in np.eye(6)[:, 3:]])
    change = np.einsum("jki,kia->kaj", forces - turned, frames) @ np.linalg.inv(stiffness(g))
    rest = np.einsum("kia,ki->ka", frames, g.squeeze)
    return frames, rest, change @ loads.offset, change @ loads.axes


def squeeze(c):
    """The squeeze survives, its worst load is one, and no squeeze survives more than the bound."""
    g = c.grip
    if not sensible(g) or not 0.0 <= c.scale <= c.upper or c.max_push_n < 0.0:
        return False
    if c.motors is not None and not strong_enough(c.motors, len(g.friction)):
        return False
    frames, rest, offset, change = responding(g, c.loads)
    slack = 2e-6 * (c.max_push_n + c.scale * np.linalg.norm(change, axis=(1, 2)).max())
    states = [(rest + offset, c.scale * change)] + [(rest, 0.0 * change)] * bool(
        c.loads.offset.any()
    )
    if not all(survives(c, start, swing, slack) for start, swing in states):
        return False
    if not ends(c, rest + offset, c.scale * change, slack):
        return False
    best = largest_scale(g, frames, offset, change, c)
    unit = c.max_push_n / np.linalg.norm(change, axis=(1, 2)).max()
    return bool(c.upper >= best * (1.0 - 1e-4) - 1e-6 * unit)


def survives(c, start, swing, slack):
    """Whether cones, pushes and torques are kept by all forces start + swing z."""
    mu = c.grip.friction
    across, leaning = start[:, 1:] @ CIRCLE.T, lean(swing, mu)
    reach = np.linalg.norm(swing[:, 0], axis=1)
    torques, room = torques_of(c.motors, c.grip.normals, 1.0)
    swung = np.linalg.norm(torques @ swing.reshape(len(torques.T), -1), axis=1)
    return bool(
        (across + leaning - (mu * start[:, 0])[:, None]).max() <= slack
        and (start[:, 0] + reach).max() <= c.max_push_n + slack
        and (start[:, 0] - reach).min() >= -slack
        and (torques @ start.ravel() + swung - room).max(initial=-1.0) <= slack * hardest(torques)
    )


def ends(c, start, swing, slack):
    """Whether the worst load takes the contact or the joint that is named to its end."""
    i, j, z, mu = c.contact, c.joint, c.direction, c.grip.friction
    if abs(np.linalg.norm(z) - 1.0) > UNIT or (i < 0) == (j < 0):
        return False
    torques, room = torques_of(c.motors, c.grip.normals, 1.0)
    forces = start + swing @ z
    if j >= 0:
        left = (room - torques @ forces.ravel())[[j, j + len(room) // 2]].min()
        return bool(left <= 20.0 * slack * hardest(torques))
    n, *t = forces[i]
    return bool(np.hypot(*t) >= mu[i] * n - 20.0 * slack or n >= c.max_push_n - 20.0 * slack)


def hardest(torques):
    """Share of a limit that forces of one newton ask of a joint at most."""
    return np.abs(torques).sum(axis=1).max(initial=0.0)


def strong_enough(motors, count):
    """Whether motors are some for so many contacts, and carry their links."""
    fit = motors.levers.shape == (len(motors.limits), 3 * count)
    return fit and bool((np.abs(motors.gravity) < motors.limits).all())


def lean(change, mu):
    """Length of B'u - mu a over the circle of directions u, (k, 720)."""
    tilted = np.einsum("gj,kjm->kgm", CIRCLE, change[:, 1:]) - (mu[:, None] * change[:, 0])[:, None]
    return np.linalg.norm(tilted, axis=2)


class Rows:
    """Rows of a linear program in squeeze and scale."""

    def __init__(self, states, mu, torques, room):
        self.states, self.mu, self.A, self.b = states, mu, [], []
        for start, swing in states:
            for i in range(len(mu)):
                for sign in (1.0, -1.0):
                    row = np.zeros(3 * len(mu) + 1)
                    row[3 * i], row[-1] = sign, np.linalg.norm(swing[i, 0])
                    self.A.append(row)
                    self.b.append((sign > 0.0) - sign * start[i, 0])
            swung = np.linalg.norm(torques @ swing.reshape(len(torques.T), -1), axis=1)
            self.A += list(np.column_stack([torques, swung]))
            self.b += list(room - torques @ start.ravel())
        for j in range(0, 720, 30):
            self.take([np.full(len(mu), j)] * len(states))

    def take(self, places):
        """One more direction for each contact in each state."""
        for (start, swing), turns in zip(self.states, places, strict=True):
            leaning = lean(swing, self.mu)
            for i, j in enumerate(turns):
                row = np.zeros(3 * len(self.mu) + 1)
                row[3 * i], row[3 * i + 1 : 3 * i + 3] = -self.mu[i], CIRCLE[j]
                row[-1] = leaning[i, j]
                self.A.append(row)
                self.b.append(self.mu[i] * start[i, 0] - CIRCLE[j] @ start[i, 1:])

    def worst(self, f, s):
        """Directions in which a squeeze breaks the cones most."""
        return [
            ((f + start)[:, 1:] @ CIRCLE.T + s * lean(swing, self.mu)).argmax(axis=1)
            for start, swing in self.states
        ]


def largest_scale(g, frames, offset, change, c):
    """By a linear program with rows of 720 directions, taken up where they are broken most."""
    k, most = len(g.friction), c.max_push_n or 1e-12
    unit = most / np.linalg.norm(change, axis=(1, 2)).max()
    states = [(offset / most, change * unit / most)]
    states += [(0.0 * offset, 0.0 * change)] * bool(c.loads.offset.any())
    size = np.linalg.norm(g.arms, axis=1).max() or 1.0  # tampered arms may all be zero
    columns = [
        np.append(v, np.cross(arm, v) / size)
        for arm, frame in zip(g.arms, frames, strict=True)
        for v in frame.T
    ]
    torques, room = torques_of(c.motors, g.normals, most)
    rows, scale = Rows(states, g.friction, torques, room), 0.0
    for _ in range(12):
        answer = linprog(
            np.append(np.zeros(3 * k), -1.0), A_ub=np.array(rows.A), b_ub=np.array(rows.b),
            A_eq=np.column_stack([*columns, np.zeros(6)]), b_eq=np.zeros(6),
            bounds=[(None, None)] * (3 * k) + [(0.0, None)],
        )  # fmt: skip
        if answer.status != 0:
            return 0.0
        scale = answer.x[-1]
        rows.take(rows.worst(answer.x[:-1].reshape(k, 3), scale))
    return scale * unit


def ray(g, motors, most, d):
    """Largest mass that contacts hold whose weight points along d."""
    load = np.append(d, np.cross(-g.arms.mean(axis=0), d) / unit_arms(g.arms)[1])
    rows = torques_of(motors, g.normals, most)
    none = np.zeros(len(g.arms))
    return largest_multiple(g.arms, g.normals, g.friction, none, load, rows, most) / GRAVITY
