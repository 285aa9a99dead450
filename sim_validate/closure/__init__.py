"""Does a grasp hold in simulation what the analysis says it holds?

`validate` puts trials, negative controls and repeats with noise into a verdict, `command` simulates
the grasps of a file, and `replaying` simulates a recorded trial again.
"""
