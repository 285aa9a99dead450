"""How much better could the contacts of a grasp be?

A grasp comes in, with the faces that its contacts may move on. A grasp of better Ferrari-Canny
quality goes out, and a proved ceiling that no contacts on these faces exceed.
"""
