"""Render a run's tables and figures from its files; nothing in here measures, or names a kind."""
