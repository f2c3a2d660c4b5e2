"""Opponents beyond the present population: its past, scripted policies, and islands that exploit it."""
