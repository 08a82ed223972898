# Needs Python >= 3.11 and make, nothing else. `make report` and `make test` set up .venv themselves.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Files of tests are shared out among so many processes; a kernel's threads wait without spinning.
JOBS ?= 2
PYTEST := $(BIN)/pytest -n $(JOBS) --dist loadfile

.PHONY: help report quick test lint types contracts fast unit mutation oldest fuzz corpus clean reference-runs results

help:
	@echo "make report     run the paper experiment in its quick form on the built-in scenes"
	@echo "make quick      before a commit: lint, types, import contracts and the fast tests"
	@echo "make test       lint, types, import contracts and all tests"
	@echo "make mutation   take away the guards of the certified proof, one at a time"
	@echo "make oldest     try everything once with the oldest dependencies that are allowed"
	@echo "make fuzz       junk at every argument of the public API, and damaged mesh files, all of it"
	@echo "make corpus COLLECTIONS='NAME=FOLDER ...'  compare mesh readers over public collections"
	@echo "make reference-runs  measure what stands behind docs/results: half an hour on a quiet machine"
	@echo "make results    render docs/results and the findings in README from the runs committed there"
	@echo "make cold-start  seconds that the first picture waits for compilation"
	@echo "make compare-aa  runs of one program and of a slower one: what \`hybrid-rt compare\` says"
	@echo "make clean      remove .venv and caches"

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[test]"
	@touch $@

report: $(STAMP)
	$(BIN)/hybrid-rt run paper --quick

quick: lint types contracts fast

test: lint types contracts unit

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

contracts: $(STAMP)
	$(BIN)/lint-imports

fast: $(STAMP)
	$(PYTEST) -m "not slow"

unit: $(STAMP)
	$(PYTEST)

mutation: $(STAMP)
	$(BIN)/python tests/mutation/guards.py --jobs $(JOBS)

oldest: $(STAMP)
	$(BIN)/python tests/oldest/oldest.py

fuzz: $(STAMP)
	HYBRID_RT_FUZZ=1 $(BIN)/pytest tests/library/fuzz tests/library/scene/io

corpus: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[test,corpus,draco,meshopt]"
	$(BIN)/python tests/corpus/corpus.py $(COLLECTIONS)

reference-runs: $(STAMP)
	$(BIN)/python bench/reference_runs.py

results: $(STAMP)
	$(BIN)/python bench/docs_results.py

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: cold-start
cold-start: $(STAMP)
	$(BIN)/python bench/cold_start.py

.PHONY: compare-aa
compare-aa: $(STAMP)
	$(BIN)/python bench/compare_aa.py
