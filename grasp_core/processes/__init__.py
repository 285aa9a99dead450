"""Other processes of this machine that do parts of one computation, with results in order."""
