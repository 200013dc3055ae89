"""A body, a run, a response or a batch in a few plain sentences: what moves, what dominates, what not to trust."""
