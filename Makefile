PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
STAMP := .venv/.ready

# The matrices are small: threads inside them cost more than they bring, and two test workers share two cores.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test check bench docs clean

demo: $(STAMP)
	$(BIN)/plastica run examples/pmma_strip.toml --output out/demo

test: $(STAMP) check
	$(BIN)/python -m pytest -n 2 --dist loadfile --durations 10 --durations-min 1

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(STAMP)
	$(BIN)/python -m benchmarks

docs: $(STAMP)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs]' --no-build-isolation
	$(BIN)/python -m sphinx -W --keep-going -b html docs out/docs

$(STAMP): pyproject.toml constraints.txt
	rm -rf .venv
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt hatchling editables
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --no-build-isolation --editable '.[test]'
	touch $(STAMP)

clean:
	rm -rf .venv out .mypy_cache .ruff_cache .pytest_cache
