"""How are bytes, text, tables and folders read and written?

This room reads and writes text, arrays and locked folders by their paths; it knows nothing about
grasps.
"""
