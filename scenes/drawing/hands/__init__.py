"""What does a hand look like in the pose in which it stands in a grasp?"""
