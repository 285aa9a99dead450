"""Does a grasp hold in simulation what the analysis says it holds?

This folder takes an object, a grasp, a setup (how trials are simulated) and an agenda (which trials
to run). It returns a verdict: trials under wrenches, trials of negative controls (contact sets that
must fail), and repeats with noise.
"""
