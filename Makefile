# Everything lives in .venv at the root: `make run` and `make test` create it when it is missing.

# On Python 3.11 the environment is the one of the lock, hash by hash; on a newer Python it is
# what pyproject.toml allows. Another interpreter: make run PYTHON=/path/to/python3
PYTHON ?= python3.11 python3.12 python3.13 python3.14 python3
# Hypothesis draws its examples from this seed: make test SEED=7 draws others.
SEED ?= 0

LOCK  := requirements/lock-py311.txt
VENV  := .venv
READY := $(VENV)/.ready
BIN   := $(VENV)/bin
PIP   := $(BIN)/python -m pip --quiet --quiet --disable-pip-version-check

# The integrator's compiled code is kept beside the environment while testing, not in $HOME.
tests_cache = HEYOKA_CACHE_DIR="$(CURDIR)/.cache/heyoka"
pytest = $(tests_cache) $(BIN)/python -m pytest -q -n 2 --hypothesis-seed=$(SEED)

.PHONY: help run test slow check proofs docs lock clean
.DELETE_ON_ERROR:

help:
	@echo 'make run     integrate the kicked top of SICM 2.10; results and figures go to out/sicm-kicked'
	@echo 'make test    run the tests, but those that are slow'
	@echo 'make slow    run the slow tests: studies killed and resumed, every scene drawn, random motions'
	@echo 'make check   ruff, mypy --strict, the layers (import-linter), and the examples in docstrings'
	@echo 'make proofs  measure all that is claimed, on a quiet machine; goes on after a kill'
	@echo 'make docs    execute the pages and the commands on them; HTML goes to build/docs'
	@echo 'make lock    resolve requirements/lock-py311.txt anew'
	@echo 'make clean   remove .venv, out and all caches'

run: $(READY)
	@$(BIN)/heavytop run sicm-kicked -o out/sicm-kicked

test: $(READY)
	$(pytest) --dist loadfile -m 'not slow' $(ARGS)

slow: $(READY)
	$(pytest) --dist worksteal -m slow $(ARGS)

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict src
	$(BIN)/lint-imports
	$(tests_cache) $(BIN)/python -m pytest -q --doctest-modules src

# What a kill left in out/proofs is taken up; what is whole is measured anew.
proofs: $(READY)
	@test ! -e out/proofs/validate.json || rm -r out/proofs
	@$(BIN)/heavytop validate --proofs -o out/proofs

# Every warning fails: a page that does not run, a command that ends badly, a name left out.
docs: $(READY)
	@$(tests_cache) $(BIN)/python -m sphinx -q -b html -W --keep-going -E -d .cache/doctrees docs build/docs
	@echo build/docs/index.html

# --upgrade: without it pip-compile keeps every old pin that still fits.
lock: $(READY)
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
	    { echo 'heavytop: the lock is for Python 3.11: make clean, then make lock PYTHON=python3.11' >&2; exit 1; }
	$(BIN)/python requirements/wanted.py | $(BIN)/pip-compile --quiet --upgrade --generate-hashes \
	    --allow-unsafe --strip-extras --no-header --no-emit-index-url --no-emit-find-links \
	    --no-emit-trusted-host --no-emit-options --output-file $(LOCK) -

clean:
	rm -rf $(VENV) out build dist docs/examples .cache .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
	find src tests validation -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

# The stamp stands only after a whole installation; a half-made environment is taken up again.
$(READY): pyproject.toml $(LOCK)
	@test "$$(uname -s)" = Linux || { \
	    echo 'heavytop: make is for Linux: elsewhere pip has no wheels of the integrator.' >&2; \
	    echo '  with it:     conda env create -f environment.yml && conda activate heavytop' >&2; \
	    echo '  without it:  python -m pip install .    (all but what integrates)' >&2; exit 1; }
	@if ! $(BIN)/python -c 'import sys, pip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	    python=$$(sh requirements/find_python.sh $(PYTHON)) || exit 1; \
	    echo "Creating $(VENV) with $$python (once; it takes a minute or two) ..." >&2; \
	    "$$python" -m venv --clear $(VENV) || exit 1; \
	fi; \
	if $(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then \
	    $(PIP) install --require-hashes -r $(LOCK) && \
	    $(PIP) install --no-build-isolation --no-deps -e .; \
	else \
	    $(PIP) install --upgrade 'pip>=25.1' && \
	    $(PIP) install --group dev -e '.[rivals,cluster,docs]'; \
	fi || { echo 'heavytop: the environment could not be installed; the lines above say why.' >&2; exit 1; }
	@touch $@
