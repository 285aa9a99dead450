"""How are grasps of other tools read and written?

Records of DexGraspBench are read and written, poses of parallel grippers from GraspNet and ACRONYM
are read. Nothing that a file holds is executed.
"""
