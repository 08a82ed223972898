"""Cameras: how world points become pixels, and back."""
