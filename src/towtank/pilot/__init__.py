"""Autopilots: heading, depth and roll loops, actuator limits, guidance."""
