"""A model plant's scratch Context, held in a cache entry of the system that uses it.

State in a system's Context, never on `self`: two simulations of one Diagram must not share it.
"""

from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import CacheEntry, Context, LeafSystem, ValueProducer


def DeclareScratch(system: LeafSystem, model: MultibodyPlant) -> CacheEntry:
    """Declares the cache entry; read it with EvalScratch."""
    return system.DeclareCacheEntry(
        description="scratch context of the model plant",
        value_producer=ValueProducer(
            allocate=lambda: AbstractValue.Make(model.CreateDefaultContext()),
            calc=ValueProducer.NoopCalc,
        ),
        prerequisites_of_calc={system.nothing_ticket()},
    )


def EvalScratch(entry: CacheEntry, context: Context) -> Context:
    """Returns the model plant's Context that belongs to `context`; its contents are anyone's."""
    return entry.EvalAbstract(context).get_value()
