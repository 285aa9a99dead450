"""How does an object move when forces act on it between fingertips, and what does that mean?

`stepping` alone steps the simulator. `rig` closes fingers and schedules trials; `held_or_let_go`
judges how they ended. `simulated_limits` and `simulated_friction` search for the largest wrenches
and the least friction; `closure_cases` first has all give known answers.
"""
