"""How does an object move when forces act on it between fingertips, and what does that mean?

`bench` alone simulates, by schedules of forces; `gate` first has it give known answers.
"""
