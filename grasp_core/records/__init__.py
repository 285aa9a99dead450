"""How are grasps and contacts kept in JSON files?

Plans and contact sets come in, or the text of `grasps.json` and contacts files. Text goes out, or
values whose every field is checked again.
"""
