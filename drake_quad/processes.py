"""How many processes may be asked for: the same of every command that takes `--workers`."""

import os

from drake_quad.errors import InputError

MOST_EACH = 8  # processes a core


def check_workers(workers: int) -> None:
    """Makes sure that so many processes are some, and no more than the machine bears.

    Raises:
        InputError: Naming the option, its value and what would be right.
    """
    cores = os.cpu_count() or 1
    if not 1 <= workers <= MOST_EACH * cores:
        remedy = f"give 1 to {MOST_EACH * cores} processes: there are {cores} cores"
        raise InputError(source="--workers", field="workers", value=workers, remedy=remedy)
