"""Where may each finger stand while the grasp stays in force closure?

A grasp and its faces come in, with a friction coefficient. Independent regions go out, with a proof
that covers all twists of the object and that `verify` checks again.
"""
