"""Long searches that a person may stop, to have the best that was found so far."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

# Makes what says, for as long as such a search goes on, whether the best so far will do.
Stopping = Callable[[], AbstractContextManager[Callable[[], bool]]]


def never() -> AbstractContextManager[Callable[[], bool]]:
    """A search that goes on until it ends."""
    return nullcontext(lambda: False)
