"""Where may each finger stand while the grasp stays closed?

A grasp and its faces come in, with a friction coefficient. Independent regions go out, with a cover
of all twists that proves them and that `verify` checks again.
"""
