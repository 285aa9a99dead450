"""How are bytes, text, tables and folders read and written?

Modules here read and write text, arrays and locked folders by path; none knows about grasps.
"""
