# Everything a fresh machine needs is Python 3.11 or newer and make.

PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do command -v $$p >/dev/null && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.PHONY: paper test quick hunt wheel dist lint types bench docs clean

# it compiles the kernels that it uses, half of all
paper: $(VENV)/.installed
	$(BIN)/gearmbs paper --out $(OUT)/paper

test: $(VENV)/.installed-dev
	$(BIN)/python -m gearmbs.compile
	$(BIN)/python -m pytest -n 2 --dist loadfile --ignore=tests/test_wheel.py
	$(BIN)/python -m pytest --doctest-modules gearmbs --ignore=gearmbs/cli.py

quick: $(VENV)/.installed-dev
	$(BIN)/python -m gearmbs.compile
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not slow"

# many more draws, or much longer runs, of what tests of the suite ask
hunt: $(VENV)/.installed-dev
	$(BIN)/python -m gearmbs.compile
	$(BIN)/python -m pytest -n 2 -m hunt

# what a user installs, tried away from the checkout
wheel: $(VENV)/.installed-dev
	$(BIN)/python -m pytest tests/test_wheel.py

# what is published for Linux on x86-64: a wheel with all kernels compiled, and what exports are linked of; those of the
# last one are kept, so that a further one compiles what has changed alone
dist: $(VENV)/.installed-dev
	rm -rf dist
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	$(BIN)/python -m gearmbs.kernels.ship dist/gearmbs-*-none-any.whl --out dist --kernels $(OUT)/kernels

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/vulture

types: $(VENV)/.installed-dev
	$(BIN)/mypy

bench: $(VENV)/.installed-bench
	$(BIN)/python -m benchmarks --out $(OUT)/bench

docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed; set PYTHON=/path/to/python3"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	@# found before a folder called gearmbs that lies beside somebody's script, as the checkout itself does
	@$(BIN)/python -c "import pathlib, site; pathlib.Path(site.getsitepackages()[0], 'gearmbs-checkout.pth').write_text(r'$(CURDIR)')"

$(VENV)/.installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -e '.[dev]'
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-bench: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -e '.[dev]'
	$(BIN)/python -m pip install --quiet -e '.[bench]' || echo "not every peer could be installed; the results name those left out"
	@touch $@ $(VENV)/.installed-dev $(VENV)/.installed

$(VENV)/.installed-docs: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -e '.[dev,docs]'
	@touch $@ $(VENV)/.installed-dev $(VENV)/.installed

clean:
	rm -rf $(OUT) docs/_build docs/_generated build *.egg-info
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
