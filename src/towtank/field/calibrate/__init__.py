"""Coefficients corrected by records of the sea: the most likely set, what it rests on, and what is not told."""
