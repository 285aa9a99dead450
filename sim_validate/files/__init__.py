"""How are bytes, text, tables and folders read and written?

Paths and arrays come in. Text, arrays and locked folders go out; no grasp is known here.
"""
