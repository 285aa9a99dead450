"""How long tests wait before they take something for hanging; nothing is decided by the clock."""

HANGING_S = 900.0
"""For a process of a test: the slowest everyday ones take a minute where the kernels are compiled
first; with a machine five times as slow that is shared by three. Below the 1200 s after which
pytest-timeout ends a test, which would leave the process behind."""
