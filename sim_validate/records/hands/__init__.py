"""How is a hand, and where it stands in grasps, read from a file?"""
