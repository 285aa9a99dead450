"""What do tables need so that a learner can be trained on them?

Modules here choose and compute what a build adds on request: natural negatives, labels of
executions, figures of closure, and poses of hands.
"""
