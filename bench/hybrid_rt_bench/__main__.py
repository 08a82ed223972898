"""``python -m hybrid_rt_bench`` is the command line ``hybrid-rt``."""

from hybrid_rt_bench.cli import main

if __name__ == "__main__":
    main()
