PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

.PHONY: demo test lint bench tesseract clean

demo: $(READY)
	$(BIN)/planish scan --config configs/simulated.toml -o out/demo --force

test: lint tesseract
	$(BIN)/python -m pytest -n auto --maxprocesses 4

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(READY) tesseract
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench]'
	$(BIN)/python -m bench

# The program that reads words is no Python package. Where it is missing and may not be installed, its tests are skipped.
tesseract:
	@command -v tesseract >/dev/null \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get -qq update && apt-get -qq install --no-install-recommends tesseract-ocr >/dev/null; } \
	|| echo "the system package tesseract-ocr is not installed: tests that read words are skipped"

clean:
	rm -rf .venv out build *.egg-info

# One environment beside the sources; made again only when the list of what is needed changes.
$(READY): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@
