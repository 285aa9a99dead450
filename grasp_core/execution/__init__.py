"""Do springy fingers keep hold when their forces are chosen before the load is known?

Contacts, a squeeze, the stiffness of the fingertips and a set of loads come in. Contact forces
without replanning, the load of first slip, the best squeeze and the payload go out.
"""
