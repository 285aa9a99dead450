"""What do a command's flags ask for: which object, which fingers, which trials?

In go flags and the files that they name. Out come checked values for the packages below.
"""
