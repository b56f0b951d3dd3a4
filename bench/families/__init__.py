"""Random developable sheets, sampled by every sampler that users have, flattened beside ARAP, SLIM and chords."""
