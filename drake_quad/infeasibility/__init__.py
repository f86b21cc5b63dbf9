"""Proofs that a robot cannot climb given stairs: interval bounds, branch and bound, proof files."""
