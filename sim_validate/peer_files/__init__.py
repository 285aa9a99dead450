"""How are grasps of other tools read and written?

Records of DexGraspBench are read and written. Nothing that a file names is executed.
"""
