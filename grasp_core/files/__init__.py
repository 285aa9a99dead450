"""How is any text or file read and written safely?

Bytes, text and paths come in. Checked JSON values, complaints that name a field, and files that are
whole or not there go out; no grasp is known here.
"""
