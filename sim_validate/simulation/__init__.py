"""How does an object move when forces act on it between fingertips?

This room takes a scene and schedules of forces, wrenches and friction. It returns traces of the
motion, and what they mean: held or let go, the critical friction, the largest wrench.
"""
