"""Which captive tests to run: those that leave the least uncertainty for their cost."""
