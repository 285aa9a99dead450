"""How does an object move when forces act on it between fingertips, and what does that mean?

`bench` alone steps the simulator; `rig` closes fingers and searches for limits; `gate` first has
both give known answers.
"""
