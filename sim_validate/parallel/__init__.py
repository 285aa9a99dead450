"""How is work spread over processes and machines, and interrupted?

This room calls a function on many units of work. It returns results in order, the same for any
number of processes.
"""
