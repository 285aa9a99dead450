"""How is an object with its true mass held by fingers on springs, in a palm that moves?

In go a body, a grip (contacts, springs and squeeze) and a mass. Out comes a `HeldScene`: the text
of a MuJoCo model in which the fingertips touch the object's own surface.
"""
