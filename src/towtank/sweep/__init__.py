"""Sweeps: one craft varied, every variant taken from captive tests to the verdict."""
