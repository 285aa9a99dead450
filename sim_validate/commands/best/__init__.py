"""How does the command `plan --best` find the best grasp, and say how good the planned ones are?"""
