"""How does an object move when forces act on it between fingertips, and what does that mean?

`simulate` alone steps the simulator; `limits` closes fingers and searches for the largest wrenches
and the least friction; `gate` first has both give known answers.
"""
