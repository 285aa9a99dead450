"""Answers from which palm pose and with which joints a hand reaches given contacts."""
