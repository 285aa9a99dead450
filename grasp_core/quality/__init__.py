"""How good are given contacts, and how large a wrench do they resist?

Contacts in force closure come in, with a limit on forces. Ferrari-Canny bounds, the metrics of
other tools and proved wrench limits go out.
"""
