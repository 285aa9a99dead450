"""Where does a hand stand in grasps, and what do its motors hold?

What motors are predicted to hold is held in simulation, no more. The commands `reach` and `hand`
write poses, also as records of DexGraspBench, and `export` writes them for Isaac.
"""
