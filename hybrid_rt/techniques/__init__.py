"""Marches through a screen, a file each."""
