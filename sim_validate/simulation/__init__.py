"""How does an object move when forces act on it between fingertips?

Modules here take a scene and schedules of forces, wrenches and friction. They return traces of the
motion, and what the traces mean: whether the object was held, the critical friction, and the
largest wrench that is resisted.
"""
