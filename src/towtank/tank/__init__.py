"""Stage 3: where captive tests are run."""
