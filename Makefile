# One environment in .venv; every package pinned by version and hash.
PYTHON ?= python3
BIN := .venv/bin
PORT ?= 8000

.PHONY: demo test check install install-dev browser campaign bench golden lock format clean

demo: install
	$(BIN)/cockpit demo --port $(PORT)

test: check browser
	$(BIN)/pytest

campaign: install-dev
	$(BIN)/pytest -s tests/campaigns

bench: install
	$(BIN)/cockpit bench

check: install-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: install-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

install: .venv/.warm
install-dev: .venv/.installed-dev

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; '$(PYTHON)' is $$($(PYTHON) -V). Try: make PYTHON=python3.11 $(MAKECMDGOALS)"; exit 2; }
	$(PYTHON) -m venv .venv

.venv/.installed: .venv/bin/python requirements.lock pyproject.toml
	$(BIN)/python -m pip install --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# Compiled anew whenever a kernel's text is newer: numba would not see it in what calls the kernel.
.venv/.warm: .venv/.installed $(shell grep -rl --include='*.py' 'from numba' backend) backend/warm.py
	$(BIN)/python -m backend.warm
	@touch $@

.venv/.installed-dev: .venv/.warm requirements-dev.lock
	$(BIN)/python -m pip install --disable-pip-version-check --require-hashes -r requirements-dev.lock
	@touch $@

# Browser tests drive Debian's chromium through Playwright.
browser: install-dev
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null || \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && apt-get install -y -qq chromium fonts-dejavu-core; \
	  else echo "Browser tests need chromium: sudo apt-get install chromium"; exit 2; fi

# Resolve anew: needs uv (pip install uv).
UV_COMPILE = uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
  --no-annotate --custom-compile-command "make lock" --quiet
lock:
	$(UV_COMPILE) pyproject.toml requirements-build.in -o requirements.lock
	$(UV_COMPILE) pyproject.toml requirements-build.in --extra dev -c requirements.lock -o requirements-dev.lock

# What the shipped sessions lead to, written anew on purpose: look at the diff before committing.
golden: install-dev
	$(BIN)/python tests/golden_replay.py

clean:
	rm -rf .venv artifacts
