"""Answers whether a given hand can stand in a grasp: with which joints, and from which palm pose.

`hand.py` defines a hand; `kinematics.py` says where its links are; `collisions.py` whether they
touch; `reach.py` looks for a pose.
"""
