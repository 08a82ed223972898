"""Rays and hits, in linear arrays."""
