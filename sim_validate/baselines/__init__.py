"""Is a grasp as stable as it was?

Modules here compare new verdicts on grasps with a recorded baseline, explain each difference, and
say whether the grasp is still as stable as it must be.
"""
