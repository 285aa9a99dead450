"""What moved in one recorded trial?

This room takes a verdict, a grasp or a row of a dataset, simulates its trial again, and returns the
motion sample by sample.
"""
