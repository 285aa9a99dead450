"""Is a grasp as stable as it was?

This room compares fresh verdicts with a recorded baseline. It explains each difference, and says
whether it breaks what was demanded.
"""
