"""What moved in one recorded trial?

A verdict, a grasp or a dataset row comes in. The trial goes out, simulated again, with its motion
sample by sample.
"""
