# Needs Python 3.11 or newer with venv and pip, and a package index. `make PYTHON=/path/to/python3 ...` chooses another one.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet --quiet
# A lock names all that is needed: nothing is resolved again, which would look for newer releases of what has extras.
# What is imported is compiled then; most of what the libraries bring never is.
INSTALL := $(PIP) install --no-deps --no-build-isolation --no-compile --require-hashes
COMPILE := $(BIN)/uv pip compile --universal --fork-strategy fewest --generate-hashes --no-header --no-annotate --quiet
# Some tests wait, for a run in real time or a server that says nothing: a third process would use their core, but a few
# others think against the clock.
WORKERS ?= 2
PYTEST := $(BIN)/pytest -n $(WORKERS) --dist worksteal
# Where the quick and the wide tests are: nothing else is even read.
QUICK := tests/domain tests/guard tests/journal tests/stl tests/tools tests/cli/test_replay.py
WIDE := tests/agents tests/benchmarks tests/cli tests/console tests/evaluate tests/fuzz tests/guard tests/history tests/knowledge tests/links tests/llm tests/plants tests/process tests/reference tests/safety tests/service tests/stl tests/twin
SEED := 1

.PHONY: demo test quick slow wide full coverage pythons llm campaign console monitor opcua web graph results pages docs lint audit format lock help clean

## demo: a stuck cooling valve on the reactor, from the alarm to the released recovery
demo: $(VENV)/.base
	@$(BIN)/homeostat run cstr --fault cool_stuck_closed --seed $(SEED)

## test: what to run before a change is handed over; all tests but those marked slow or wide; .ci/run runs it
test: $(VENV)/.dev
	$(PYTEST) -m "not slow and not wide" --durations=30 --durations-min=5

## quick: a cross-section within a minute, for while you work: rule language, domain, guard, journal, one run
quick: $(VENV)/.dev
	$(PYTEST) -m quick $(QUICK)

## slow: what `make test` leaves out: kills, mutants, studies, whole runs; after a change of what they are about
slow: $(VENV)/.dev
	$(PYTEST) -m "slow and not wide"

## wide: more seeds, sizes and texts of what other tests show once; before a release, or after a change of twin or recovery
wide: $(VENV)/.dev
	$(PYTEST) -m wide $(WIDE)

## full: every test there is
full: $(VENV)/.dev
	$(PYTEST)

## coverage: `make test` with the lines and branches that it reaches, by package; no bar to pass
coverage: $(VENV)/.dev
	@mkdir -p build/coverage
	$(PYTEST) -m "not slow and not wide" --cov --cov-report=json:build/coverage/report.json
	@$(BIN)/python tools/coverage_table.py build/coverage/report.json

## pythons: the quick tests with every other Python from 3.11 on that is here
pythons: $(VENV)/.dev
	bash tools/other_pythons.sh

## llm: what talks to language models
llm: $(VENV)/.llm

## campaign: what studies need
campaign: $(VENV)/.campaign

## opcua: what links to control systems over OPC UA, and serves simulated plants
opcua: $(VENV)/.opcua

## console: what the console needs
console: $(VENV)/.console

## monitor: what detectors with trees and networks need
monitor: $(VENV)/.monitor

## web: the console's page again from its sources in web/; needs node and npm
web:
	cd web && npm ci --silent --no-audit --no-fund && npm run --silent check && npm run --silent build

## graph: make the plants' knowledge graphs again from the engineering tables
graph: $(VENV)/.base
	bash tools/make_graph.sh

## results: make every published figure and number again
results: $(VENV)/.dev
	bash tools/make_results.sh

## docs: the documentation as a site, in build/docs
docs: $(VENV)/.dev
	$(BIN)/sphinx-build --quiet --fail-on-warning -b html docs build/docs

## pages: which pages of docs/results are older than what they measure without saying so
pages: $(VENV)/.base
	$(BIN)/python tools/check_pages.py

## lint: style, types, layers
lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

## audit: known vulnerabilities of the locked packages
audit: $(VENV)/.dev
	$(BIN)/python tools/audit.py

## format: apply the style
format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

## lock: choose the newest versions again and write the hashed locks, each for every Python from 3.11 on
lock: $(VENV)/.dev
	$(COMPILE) --upgrade --python-version 3.11 requirements/build.in -o requirements/build.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt pyproject.toml -o requirements/base.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/base.txt --extra llm pyproject.toml -o requirements/llm.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/base.txt -c requirements/llm.txt --extra campaign pyproject.toml -o requirements/campaign.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/base.txt -c requirements/llm.txt -c requirements/campaign.txt --extra opcua pyproject.toml -o requirements/opcua.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/base.txt -c requirements/llm.txt -c requirements/campaign.txt --extra console pyproject.toml -o requirements/console.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/base.txt -c requirements/llm.txt -c requirements/campaign.txt -c requirements/opcua.txt -c requirements/console.txt --extra monitor pyproject.toml -o requirements/monitor.txt
	$(COMPILE) --upgrade --python-version 3.11 -c requirements/build.txt -c requirements/llm.txt -c requirements/campaign.txt -c requirements/opcua.txt -c requirements/console.txt -c requirements/monitor.txt --extra llm --extra campaign --extra opcua --extra console --extra monitor --extra dev pyproject.toml -o requirements/dev.txt
	$(COMPILE) --upgrade --python-version 3.11 requirements/rml.in -o requirements/rml.txt

## help: what there is to make
help:
	@sed -n 's/^## //p' $(MAKEFILE_LIST)

## clean: away with everything that was made, environments included
clean:
	rm -rf $(VENV) .rml-venv build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

$(VENV)/.build: requirements/build.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Homeostat needs Python 3.11 or newer; $(PYTHON) is %d.%d. Name another one: make PYTHON=/path/to/python3.12" % sys.version_info[:2])'
	@echo "making an environment in $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@$(INSTALL) -r requirements/build.txt
	@touch $@

$(VENV)/.base: $(VENV)/.build requirements/base.txt pyproject.toml
	@echo "installing Homeostat and what it needs"
	@$(INSTALL) -r requirements/base.txt
	@$(PIP) install --no-deps --no-build-isolation --no-index --editable .
	@touch $@

$(VENV)/.llm: $(VENV)/.base requirements/llm.txt
	@echo "installing what talks to language models"
	@$(INSTALL) -r requirements/llm.txt
	@touch $@

$(VENV)/.campaign: $(VENV)/.base requirements/campaign.txt
	@echo "installing what studies need"
	@$(INSTALL) -r requirements/campaign.txt
	@touch $@

$(VENV)/.opcua: $(VENV)/.base requirements/opcua.txt
	@echo "installing what speaks OPC UA"
	@$(INSTALL) -r requirements/opcua.txt
	@touch $@

$(VENV)/.console: $(VENV)/.base requirements/console.txt
	@echo "installing what the console needs"
	@$(INSTALL) -r requirements/console.txt
	@touch $@

$(VENV)/.monitor: $(VENV)/.base requirements/monitor.txt
	@echo "installing what detectors with trees and networks need"
	@$(INSTALL) -r requirements/monitor.txt
	@touch $@

$(VENV)/.dev: $(VENV)/.base requirements/dev.txt
	@echo "installing what tests and checks need"
	@$(INSTALL) -r requirements/dev.txt
	@touch $@
