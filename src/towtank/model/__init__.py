"""Stage 6: the 6-DOF lumped-parameter model."""
