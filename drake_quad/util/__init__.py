"""Files, YAML, schema and processes: what has nothing to do with robots."""
