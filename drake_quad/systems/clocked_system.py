"""ClockedSystem: a LeafSystem that acts at its own times alone, and costs nothing between them."""

from pydrake.systems.framework import LeafSystem


class ClockedSystem(LeafSystem):
    """A LeafSystem without witness functions.

    A Simulator asks every system for its witness functions after every unrestricted update, and
    each step of a MultibodyPlant is one. Of a system written in Python that looks for a method of
    that name, finds none, and raises and clears an error each time: with nine systems that took a
    twentieth of a run's time. pybind11 remembers of a class that a method is C++'s own, but not
    that it is missing. So here is one, whichever: it is looked up once for each class, found to be
    C++'s own, and never called.
    """

    DoGetWitnessFunctions = LeafSystem.get_name
