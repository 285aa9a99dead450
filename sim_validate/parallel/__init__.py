"""How is work spread over processes and machines, and interrupted?

Modules here call a function on many units of work, such as one grasp each. Results come in order
and are the same for any number of processes.
"""
