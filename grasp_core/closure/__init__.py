"""Are given contacts in force closure, and from which friction on?

Contacts come in as positions, inward normals and friction coefficients. Certificates go out: forces
or a separating twist, an interval for the critical friction, the type of four lines, and the sets
of wrenches that contacts can apply.
"""
