"""Kernels that make secondary rays."""
