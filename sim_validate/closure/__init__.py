"""Does a grasp hold in simulation what the analysis says it holds?

`validate` puts trials, negative controls and repeats with noise into a verdict, the command writes
verdicts, and `replaying` simulates a recorded trial again.
"""
