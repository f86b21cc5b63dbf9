"""`drake-quad`, and `python -m drake_quad`.

Ctrl-C while the command is still loading ends it at once: raised within the import of a compiled
module it would come out as that module's failure.
"""

import signal


def main() -> None:
    """Entry point of the command; it ends the process."""
    ours = signal.getsignal(signal.SIGINT)
    if ours is signal.default_int_handler:  # nobody else wants to know of it
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from drake_quad.cli.main import main as carry_out

    signal.signal(signal.SIGINT, ours)
    carry_out()


if __name__ == "__main__":
    main()
