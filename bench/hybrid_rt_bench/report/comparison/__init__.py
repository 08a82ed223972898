"""Two sides of runs of one kind, compared: what is counted exactly, times beside their baseline."""
