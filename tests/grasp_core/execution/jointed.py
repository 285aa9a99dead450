"""Motors for tests: joints behind the pushes or the sides of opposed fingers, and random hands."""

import numpy as np

import grasp_core as gc

LEVER_M = 0.05
"""Lever of a joint that pushes a finger."""


def pushing(contacts, limit, gravity=0.0):
    """One joint behind each finger, whose torque is its push times the lever."""
    levers = np.zeros((len(contacts), 3 * len(contacts)))
    for finger, contact in enumerate(contacts):
        levers[finger, 3 * finger : 3 * finger + 3] = LEVER_M * contact.normal
    return gc.Motors.of(levers, limit, gravity)


def jaws(contacts, limit):
    """One joint behind all fingers on each side along x."""
    levers = np.zeros((2, 3 * len(contacts)))
    for finger, contact in enumerate(contacts):
        levers[int(contact.normal[0] > 0.0), 3 * finger] = LEVER_M * contact.normal[0]
    return gc.Motors.of(levers, limit)


def lifting(count, limit):
    """One joint behind each finger, whose torque is its force along z times the lever."""
    levers = np.zeros((count, 3 * count))
    levers[np.arange(count), 3 * np.arange(count) + 2] = LEVER_M
    return gc.Motors.of(levers, limit)


def hand_of(rng, contacts, torque, weight=0.5, joints=3, lever_m=0.04):
    """A hand with so many joints for each finger, as long as fingers are, whose links weigh."""
    levers = np.zeros((joints * contacts, 3 * contacts))
    for finger in range(contacts):
        own = slice(joints * finger, joints * (finger + 1))
        levers[own, 3 * finger : 3 * finger + 3] = lever_m * rng.normal(size=(joints, 3))
    limits = torque * rng.uniform(0.5, 1.5, size=len(levers))
    return gc.Motors(levers, limits, weight * limits * rng.uniform(-1.0, 1.0, size=len(levers)))
