"""Runs that are killed, starved and tampered with: what they must survive, tried for real (`make faults`)."""
