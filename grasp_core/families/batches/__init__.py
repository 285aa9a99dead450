"""Places contacts for many attempts of a construction at once, in compiled code.

What is proved here is proved to the same limits as by the modules that place contacts one by one;
what is not proved is left to them.
"""
