"""How much better could the contacts of a grasp be?

A grasp comes in, with the faces that its contacts may move on. A grasp of better Ferrari-Canny
quality goes out, and a proved ceiling that no contacts on these faces exceed; or, of an object
alone, the best four contacts on it, with a tree of cuts that proves that none are better by more
than a gap.
"""
