"""Answers whether a given hand can stand in a grasp: with which joints, and from which palm pose.

`hand.py` defines a hand; `hand_arrays.py` says where its links are; `collisions.py` whether they
touch; `reach.py` looks for a pose.

Unless a function says otherwise, lengths are in metres and angles in radians. Joint angles are
(j,), palm poses (4, 4) in the object's frame, points and directions (3,), or one in each row. In
compiled loops the s shapes of a hand have axes (s, 3, 3) and middles (s, 3), and the n balls of a
surface's tree middles (n, 3), radii (n,) and children (n, 2).
"""
