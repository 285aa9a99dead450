"""Verdicts kept in a repository, so that a change of stability is noticed."""
