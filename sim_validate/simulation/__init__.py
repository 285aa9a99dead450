"""What moves when forces act on an object between fingertips?

A scene comes in, with schedules of forces, wrenches and friction. Traces of the motion go out, and
what they mean: held or let go, critical friction, largest wrench.
"""
