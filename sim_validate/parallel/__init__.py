"""How is work spread over processes and machines, and interrupted?

A function and its units of work come in. Results go out in order, the same for any number of
processes.
"""
