"""Stage 2: which captive tests."""
