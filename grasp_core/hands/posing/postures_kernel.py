"""Tries many joint angles of a hand for collisions of the hand with itself, compiled."""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.hands.distances.collisions_kernel import of_itself, place_shapes
from grasp_core.hands.kinematics_kernel import chains, moved
from grasp_core.hands.loop_values import HandArrays


@loop()
def free_postures(
    hand: HandArrays, angles: Array, apart: float, widest: float, kept: Indices, tips: Array
) -> int:
    """Choose joint angles at which a hand is free of itself and its fingertips are near each other.

    Takes `angles` (n, j) [rad]; `apart`, `widest` [m]; `kept` (m,); `tips` (m, f, 3) [m]. Gives how
    many were chosen, at most m.
    """
    count, fingers, found = len(hand.axes), len(hand.tip_radii), 0
    R, p, W = np.empty((count, 3, 3)), np.empty((count, 3)), np.empty((count, 3))
    turned, middles = np.empty((len(hand.shape_links), 3, 3)), np.empty((len(hand.shape_links), 3))
    eye, zero, middle, worst = np.eye(3), np.zeros(3), np.empty(3), np.empty(2, np.int64)
    for n in range(len(angles)):
        if found == len(kept):
            break
        chains(
            hand.positions, hand.rotations, hand.axes, hand.starts, eye, zero, angles[n], R, p, W
        )
        middle[:] = 0.0
        for f in range(fingers):
            last = hand.starts[f + 1] - 1
            moved(R[last], p[last], hand.tip_centers[f], tips[found, f])
            for j in range(3):
                middle[j] += tips[found, f, j] / fingers
        near = True
        for f in range(fingers):
            square = 0.0
            for j in range(3):
                square += (tips[found, f, j] - middle[j]) ** 2
            near = near and square <= widest * widest
        if not near:
            continue
        place_shapes(hand, eye, zero, R, p, turned, middles)
        if of_itself(hand, turned, middles, apart, worst) >= apart:
            kept[found] = n
            found += 1
    return found
