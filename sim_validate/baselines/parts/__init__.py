"""Which solid do the tests of grasps hold, and how has it changed?

A mesh file, the grasps that were planned on it and what a baseline recorded of it come in. The
grasps on the part as it is now, and how its faces moved since the baseline, go out.
"""
