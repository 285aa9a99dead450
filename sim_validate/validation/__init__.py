"""Does a grasp hold in simulation what the analysis says it holds?

This room takes an object, a grasp, a setup and an agenda. It returns a verdict: trials under
wrenches, negative controls that must let go, and repeats with noise.
"""
