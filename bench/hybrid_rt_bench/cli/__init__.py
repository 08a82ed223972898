"""The command line ``hybrid-rt``, a file a command."""


def main() -> None:
    """Run the command line; errors made on purpose become one line on stderr."""
    try:
        # Not above: what is imported takes a moment, in which Ctrl-C may come.
        from hybrid_rt_bench.cli.app import run_app
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    run_app()
