"""Captive tests in OpenFOAM: cases written, run, watched and read. Its programs are called, never linked."""
