"""Tracers: whatever answers any ray."""
