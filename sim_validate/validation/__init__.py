"""Does a grasp hold in simulation what the analysis says it holds?

An object, a grasp, a setup and an agenda come in. A verdict goes out: trials under wrenches,
negative controls that must let go, repeats with noise.
"""
