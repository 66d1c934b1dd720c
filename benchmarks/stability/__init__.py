"""Numbers at the ends of their ranges: how wrong, or refused in which words."""
