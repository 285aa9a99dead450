"""How is a threshold refuted, on any number of threads, and which contacts does that find?

Twists are kept, found and asked by compiled code; parts of the tree are searched side by side and
joined.
"""
