"""The folder of a run, what its columns mean, and the statistics of its samples."""
