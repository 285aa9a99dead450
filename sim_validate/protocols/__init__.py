"""Published tests of grasps, run as they are stated, and how their verdicts compare to ours."""
