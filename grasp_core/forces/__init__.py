"""Which contact forces balance a wrench?

Contacts, friction, limits on forces and a wrench come in. Forces inside the friction cones go out:
least in size, least in friction, or most even.
"""
