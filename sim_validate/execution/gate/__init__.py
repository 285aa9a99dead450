"""Does the simulator execute grasps right with these settings?

Modules here check the simulation of executed grasps on cases whose answers are known in closed
form: a box between four fingers, an object that nothing holds, and fingertips on its faces. They
take the masses, springs, friction and size in force. If one check fails, no grasp is executed.
"""
