"""How is an object of a stated mass held while the test of another tool runs?

The object has its own surface and true inertia; fingertips or a hand close on it and squeeze.
"""
