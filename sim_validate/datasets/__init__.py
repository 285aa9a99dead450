"""What is a dataset of grasps?

Many objects and several frictions come in, by a configuration. Tables of objects, grasps and trials
go out; `building` makes them, `verifying` checks them, `describing` and `exports` tell others.
"""
