# make demo   environment, fillet of the bracket, picture, comparison with the exact fillet
# make test   everything: lint, types, the suite beside CadQuery, the host tests beside build123d, kernels without JIT,
#             and within FreeCAD where that is installed
PYTHON ?= python3
# Waiting threads sleep instead of spinning: several processes share the cores.
export OMP_WAIT_POLICY ?= passive
VENV := .venv
VENV_B123D := .venv-build123d
# FreeCAD's modules are those of the system's Python, and so are its numpy and scipy.
VENV_FREECAD := .venv-freecad
PYTHON_FREECAD ?= /usr/bin/python3
FREECAD_LIBRARY ?= /usr/lib/freecad-python3/lib
PIP := -m pip install --quiet --disable-pip-version-check

# make bench  time, memory and error beside other packages, and of each stage
# make paper  the paper's examples, tables and figures on one page, paper/paper.html
.PHONY: demo paper test lint test-cadquery test-build123d test-freecad test-nojit bench clean

demo: $(VENV)/ready
	$(VENV)/bin/cad-implicit demo -o demo

paper: $(VENV)/ready
	$(VENV)/bin/python -m validation.paper -o paper

test: lint test-nojit test-build123d test-freecad test-cadquery

lint: $(VENV)/ready
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy

test-cadquery: $(VENV)/ready
	$(VENV)/bin/python -m pytest -n auto --dist loadfile

test-build123d: $(VENV_B123D)/ready
	$(VENV_B123D)/bin/python -m pytest -n auto --dist loadfile -m host tests

# FREECAD=required fails where FreeCAD is not installed.
ifneq ($(wildcard $(FREECAD_LIBRARY)/FreeCAD.so),)
test-freecad: $(VENV_FREECAD)/ready
	FREECAD_LIBRARY=$(FREECAD_LIBRARY) PYTHONPATH=$(CURDIR) LANG=C.UTF-8 \
		$(VENV_FREECAD)/bin/python -m pytest -n auto --dist loadfile -m freecad tests/freecad \
		--ignore=tests/freecad/gui_pytest.py
	tests/freecad/run_gui.sh $$($(VENV_FREECAD)/bin/python -c "import sysconfig; print(sysconfig.get_path('purelib'))")
else
test-freecad:
	@echo "SKIPPED: the tests within FreeCAD, which is not installed ($(FREECAD_LIBRARY)/FreeCAD.so is missing)"
	@test "$(FREECAD)" != required
endif

test-nojit: $(VENV)/ready
	NUMBA_DISABLE_JIT=1 $(VENV)/bin/python -m pytest -m nojit tests

bench: $(VENV)/ready
	$(VENV)/bin/python $(PIP) -e ".[peers]"
	$(VENV)/bin/python -m validation.peers
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

# Constraints keep Debian's numpy and scipy, which FreeCAD was built with. The package itself is found by PYTHONPATH:
# FreeCAD does not process the links of editable installs.
$(VENV_FREECAD)/ready: pyproject.toml
	$(PYTHON_FREECAD) -m venv --system-site-packages $(VENV_FREECAD)
	$(VENV_FREECAD)/bin/python -c "import numpy, scipy; print(f'numpy=={numpy.__version__}\nscipy=={scipy.__version__}')" \
		> $(VENV_FREECAD)/constraints.txt
	$(VENV_FREECAD)/bin/python $(PIP) -c $(VENV_FREECAD)/constraints.txt numba manifold3d scikit-image trimesh lxml \
		networkx pynrrd psutil typer rich plotly pytest pytest-xdist hypothesis
	touch $@

clean:
	rm -rf $(VENV) $(VENV_B123D) $(VENV_FREECAD) demo
