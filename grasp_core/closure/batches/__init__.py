"""Decides force closure of many sets of contacts at once, with the proofs of `force_closure`."""
