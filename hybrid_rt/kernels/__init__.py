"""Numba functions on raw arrays: no validation, outputs preallocated and passed last.

A kernel is reached through the API module of the same name one level up.
"""
