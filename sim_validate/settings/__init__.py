"""What do users choose for trials of closure and for executions?

Commands, files and Python take the same classes. Nothing here is slow to import, since command-line
help waits for it.
"""
