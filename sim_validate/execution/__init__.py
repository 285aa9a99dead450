"""Does a grasp survive what a robot does with the object, with one squeeze and true masses?

Trials move the palm: they lift, shake, stop and knock. `execute` runs them beside what is predicted
for each; the command writes executions, and `scene` the models that trials run in.
"""
