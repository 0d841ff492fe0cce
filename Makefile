# make demo   environment, fillet of the bracket, picture, comparison with the exact fillet
# make test   everything: lint, types, the suite beside CadQuery, the host tests beside build123d, kernels without JIT
PYTHON ?= python3
# Waiting threads sleep instead of spinning: several processes share the cores.
export OMP_WAIT_POLICY ?= passive
VENV := .venv
VENV_B123D := .venv-build123d
PIP := -m pip install --quiet --disable-pip-version-check

# make paper  the paper's examples, tables and figures on one page, paper/paper.html
.PHONY: demo paper test lint test-cadquery test-build123d test-nojit bench clean

demo: $(VENV)/ready
	$(VENV)/bin/cad-implicit demo -o demo

paper: $(VENV)/ready
	$(VENV)/bin/python -m validation.paper -o paper

test: lint test-nojit test-build123d test-cadquery

lint: $(VENV)/ready
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy

test-cadquery: $(VENV)/ready
	$(VENV)/bin/python -m pytest

test-build123d: $(VENV_B123D)/ready
	$(VENV_B123D)/bin/python -m pytest -m host tests

test-nojit: $(VENV)/ready
	NUMBA_DISABLE_JIT=1 $(VENV)/bin/python -m pytest -m nojit tests

bench: $(VENV)/ready
	$(VENV)/bin/python -m validation.table1
	$(VENV)/bin/python -m validation.bench_redistance
	$(VENV)/bin/python -m validation.bench_distance
	$(VENV)/bin/python -m validation.bench_dual 128
	$(VENV)/bin/python -m validation.accuracy
	$(VENV)/bin/python -m validation.bench_exact

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python $(PIP) --upgrade pip
	$(VENV)/bin/python $(PIP) -e ".[cadquery,reports,dev]"
	touch $@

$(VENV_B123D)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV_B123D)
	$(VENV_B123D)/bin/python $(PIP) --upgrade pip
	$(VENV_B123D)/bin/python $(PIP) -e ".[build123d,dev]"
	touch $@

clean:
	rm -rf $(VENV) $(VENV_B123D) demo
