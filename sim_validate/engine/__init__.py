"""How does an object move when forces act on it between fingertips, and what does that mean?

`simulate` alone steps the simulator; `limits_and_friction` closes fingers and searches for the
largest wrenches and the least friction; `gate` first has both give known answers.
"""
