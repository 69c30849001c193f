"""The rod: specimen and scales, loads, the quasi-static strut, its ledger and its bounds."""
