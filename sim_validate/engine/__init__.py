"""How does an object move when forces act on it between fingertips, and what does that mean?

`stepping` alone steps the simulator. `rig` closes fingers and schedules trials, `early_ends` ends
those whose answer is known, and `held_or_let_go` judges them. `simulated_limits` and
`simulated_friction` search for the largest wrenches and the least friction; `closure_cases` first
has all give known answers.
"""
