"""Sweeps: a craft varied along some axes, every variant taken from captive tests to the verdict."""
