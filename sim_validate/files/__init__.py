"""How are files of results written whole, locked, read and replaced?"""
