"""How is any text or file read and written safely?

Bytes, text and paths come in. Checked JSON values, messages that name a field, and files that are
either complete or absent go out; nothing here knows about grasps.
"""
