"""What does a grasp or a motion look like?

This package turns objects, grasps and motions into pictures and clips.
"""
