"""Run what is to be measured: in this process, or each cell in a process of its own."""
