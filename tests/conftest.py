"""Settings of all tests: those with random cases have no time limit, and try the same cases everywhere."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

# Hypothesis fails a test that draws too few cases a second, which says more of the machine than of the test.
settings.register_profile("plastica", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("plastica")
