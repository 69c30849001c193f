"""Studies: the scenario a user writes, and how it is run."""
