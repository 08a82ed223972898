"""Kernels of the certified march."""
