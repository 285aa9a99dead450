"""What became of grasps on a changed part, as a file.

What `gc.transfer` found goes to `transfer.json`, and what was written there is read back.
"""
