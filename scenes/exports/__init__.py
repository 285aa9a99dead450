"""How do other programs read grasps?

Modules here write the grasps of a plan in the formats of other programs. Only the module of a
format knows the outside library that writes it.
"""
