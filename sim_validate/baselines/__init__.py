"""Is a grasp as stable as it was?

A recorded baseline and fresh verdicts come in. Differences go out, each explained, and whether they
break what was demanded.
"""
