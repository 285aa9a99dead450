"""Which four contacts on an object are best, and what proves that none are better?

An object and a friction coefficient come in. The best contacts found go out, with a bound that no
four contacts on its faces exceed, and a tree of cuts that proves it.
"""
