PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
WARM := .venv/.warm

.PHONY: demo test lint docs bench setup system clean

demo: setup
	$(BIN)/planish scan --config configs/simulated.toml -o out/demo --force

test: lint setup
	$(BIN)/python -m pytest -n auto --maxprocesses 4

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

setup: $(WARM)

# What pip cannot bring: libraries that open3d and pymeshlab take from the system, and the program that reads words.
# Where they may not be installed, they are named, and the tests that need them are skipped.
system: $(READY)
	@missing=$$($(BIN)/planish doctor --packages | tr '\n' ' '); \
	[ -z "$$missing" ] \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get -qq update \
		&& apt-get -qq install --no-install-recommends $$missing >/dev/null; } \
	|| echo "not installed: $$missing(install them with: sudo apt install $$missing)"

clean:
	rm -rf .venv out build *.egg-info

# One environment beside the sources; made again only when the list of what is needed changes.
$(READY): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@

# Compiled once, when all libraries are there: no first run has to wait.
$(WARM): $(READY) | system
	$(BIN)/planish warm-up
	touch $@
