"""What does a grasp or a motion look like?

This room turns objects, grasps and motions into pictures and clips.
"""
