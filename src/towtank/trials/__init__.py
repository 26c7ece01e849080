"""Stage 7: free-running trials."""
