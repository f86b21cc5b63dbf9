"""The course: as it is mapped, and as it is built."""
