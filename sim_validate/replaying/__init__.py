"""One trial of a file, simulated again, with all that moved."""
