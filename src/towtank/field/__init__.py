"""Records of a craft at sea: read, replayed, compared with the model, used to correct it; and records made up."""
