"""What does a grasp or a motion look like?

Objects, grasps and motions come in. Pictures and clips go out.
"""
