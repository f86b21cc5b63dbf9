"""Which gait climbs these stairs: candidates, their objective, the search."""
