"""Record and model side by side: metrics fixed in advance, the band of the model, what is validated at which level."""
