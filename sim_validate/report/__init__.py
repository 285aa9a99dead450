"""How are the results of a run shown to people?

Modules here turn the folder of a run into charts, and into pages that a browser opens from disk;
the commands show one grasp, a run, or the motion of one trial.
"""
