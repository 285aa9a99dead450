"""Answers what hand an MJCF or URDF file describes.

`model_text.py` reads the file and what it names, within bounds; `model.py` compiles it with MuJoCo;
`fingers.py` finds fingers in the compiled model; `building.py` puts a hand together.
"""
