"""Equilibria of the strut: closed forms, all of them, their spectrum, and where a motion ends."""
