"""The log of a session: events, their facts, the folded state, the bag."""
