"""A folder a kind of experiment; each registers itself, and none knows another."""
