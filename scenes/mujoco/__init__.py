"""Which MuJoCo model stands for a grasp: its object, what holds it, and how they touch?

In go a body and a grasp, a grip or a hand in its pose; out come texts of models with the layout
that the simulator needs. Each test of grasps has a kind of scene: tests of closure
(`closure_scene`), executions (`held_scene`), both with hands (`hand_scenes`), and published tests
(`published_tests`, with hands as their files have them in `filed_hand`). `scene_text` writes all of
them. `hand_contacts` finds where a hand touches the object of a scene.
"""
