"""How are grasps and contacts kept in JSON files?

Plans, contact sets, and the texts of `grasps.json` and contacts files come in. Texts go out, and
values whose every field has been checked.
"""
