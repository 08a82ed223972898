"""Junk at every argument of the public API, in processes that may die of it."""
