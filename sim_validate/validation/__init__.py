"""Whether a grasp holds in simulation what the analysis says it holds: trials and verdicts."""
