"""What is claimed of the mass that a hand holds in every orientation: by programs for some."""

import numpy as np

import grasp_core as gc
from tests.tampering.exact_closure import contacts_make_sense
from tests.tampering.squeezes import GRAVITY, ray, squeeze


def payload(c):
    """No orientation that is tried holds less than the lower mass, and one no more than the upper.

    Those tried are the corners of the certificate, thirty at random, and the one of its facet.
    """
    h = c.hand
    if not (contacts_make_sense(h.arms, h.normals, h.friction) and carries_links(h)):
        return False
    if not 0.0 <= c.lower <= c.upper:
        return False
    large = max(1.0, c.upper)  # any length of the way is as good, and claims may be huge
    facing = h.weights.T @ (c.motor_multipliers / large) - GRAVITY * c.upper / large * c.facet[:3]
    ways = np.vstack([c.gravities, np.random.default_rng(0).normal(size=(30, 3)), facing])
    ways = ways[np.abs(ways).max(axis=1) > 0.0]
    ways /= np.abs(ways).max(axis=1, keepdims=True)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    least = min(held(h, way) for way in ways)
    slack = 1e-6 * h.max_push_n
    return bool(c.lower <= least + slack and c.upper >= least - slack)


def payload_of_contacts(c):
    """The squeeze is as claimed, and so is what other forces hold behind links without weight."""
    g, h, E = c.fixed.grip, c.free.hand, c.fixed.loads.axes
    ball = np.diag([GRAVITY**2] * 3 + [0.0] * 3)
    if c.fixed.loads.offset.any() or np.abs(E @ E.T - ball).max() > 1e-6 or not squeeze(c.fixed):
        return False
    motors = c.fixed.motors or gc.Motors.of(np.zeros((0, h.arms.size)), 1.0)
    pairs = (
        (h.arms, g.arms), (h.normals, g.normals), (h.friction, g.friction),
        (h.max_push_n, c.fixed.max_push_n), (h.motors.levers, motors.levers),
        (h.motors.limits, motors.limits), (h.motors.gravity, motors.gravity),
        (h.weights, np.zeros((len(motors.limits), 3))),
    )  # fmt: skip
    return all(np.array_equal(one, other) for one, other in pairs) and payload(c.free)


def carries_links(h):
    """Whether motors are some for these contacts, and carry their links in every orientation."""
    fits = h.motors.levers.shape == (len(h.motors.limits), h.arms.size)
    taken = np.linalg.norm(h.weights, axis=1)
    return bool(fits and not h.motors.gravity.any() and (taken < h.motors.limits).all())


def held(h, way):
    """The largest mass where gravity points along a unit vector and pulls at the links."""
    turned = gc.Motors(h.motors.levers, h.motors.limits, h.weights @ way)
    return ray(h, turned, h.max_push_n, way)
