"""What do other tools' tests say about a grasp, beside ours and the predicted margin?

Each test is a value: loads, durations, thresholds, with the files that state them.
"""
