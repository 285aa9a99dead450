"""Would a grasp survive being executed: weight, lift, shakes, stops, knocks, misplaced fingers?

In go a body, a grasp, its friction, and settings of mass, fingers and trials. One squeeze is
chosen, and each trial moves the palm or loads the object with the fingers' commands unchanged. Out
comes, for each trial, whether the object stayed, how far it slipped, and the first slip, as the
analysis predicts it and as it was simulated.
"""
