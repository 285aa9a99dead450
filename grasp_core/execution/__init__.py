"""Do springy fingers keep hold when their forces are chosen before the load is known?

Contacts, a squeeze, the stiffness of the fingertips and a set of loads come in. Contact forces
without replanning, the load of first slip, the best squeeze and the payload go out.

Unless a function says otherwise, contact forces are (k, 3) [N], torques of joints (joints,) [N m],
and loads, twists and small motions (6,), with torques and turns about the centre of mass.
"""
