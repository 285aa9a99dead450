"""Which grasps does an object have, how good are they, and where may fingers stand?

Modules here run the commands that need the analysis alone, such as `plan`, `regions` and `analyze`,
and write and read the files of what it found.
"""
