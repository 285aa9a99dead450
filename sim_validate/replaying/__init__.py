"""What moved in one recorded trial?

Modules here take a verdict, a grasp or a row of a dataset, simulate its trial again, and return the
motion sample by sample.
"""
