"""The garbage collector, kept from what is there to stay while a loop runs."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def frozen_objects() -> Iterator[None]:
    """Within it the collector does not look at what was there before.

    A caller that has frozen what is its own keeps that: there is no thawing of a part, so nothing
    more is frozen then.
    """
    freezes = gc.get_freeze_count() == 0
    if freezes:
        gc.collect()
        gc.freeze()
    try:
        yield
    finally:
        if freezes:
            gc.unfreeze()
