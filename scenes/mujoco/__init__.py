"""Which MuJoCo model stands for a grasp: its object, what holds it, and how they touch?

In go a body and a grasp, a grip or a hand in its pose; out come texts of models with the layout
that the simulator needs. Each test of grasps has a kind of scene: tests of closure
(`closure_scene`, `hand_scene`), executions (`held_mjcf`, `held_hand`) and published tests
(`tested`). `silent_mujoco` imports MuJoCo itself.
"""
