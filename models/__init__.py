"""Data only: robots (URDF) and scenarios (YAML) that ship with drake_quad."""
