"""What one view shows: G-buffer, pyramids, lists."""
