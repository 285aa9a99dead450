"""What becomes of grasps when their part changes?

The old part, the changed part and grasps of the old one come in. Which face became which, where
each contact is now, and whether each grasp is the same, better, worse or gone go out.
"""
