"""Pages as other people's programs write them, of known size and picture: right, or answered with a finding."""
