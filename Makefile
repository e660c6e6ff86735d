# Everything glbump needs, from nothing: `make demo` and `make test` set up what is missing, then run.
VENV ?= .venv
RUN := $(VENV)/bin/python
OUT ?= out

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo test lint format types bench studies pictures driver test-libraries clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/.ready-demo driver ## render the gallery into out/ (OUT=DIR for elsewhere)
	@$(RUN) -m glbump demo -o $(OUT)

test: $(VENV)/.ready-test driver test-libraries ## run the whole test suite (ARGS="-k cube" for a part of it)
	@$(RUN) -m pytest -n 2 --dist loadfile $(ARGS)

lint: $(VENV)/.ready-lint types ## style, format and types, changing nothing
	@$(RUN) -m ruff check .
	@$(RUN) -m ruff format --check .

types: $(VENV)/.ready-lint
	@$(RUN) -m mypy

format: $(VENV)/.ready-lint ## put the code into its one format
	@$(RUN) -m ruff check --fix .
	@$(RUN) -m ruff format .

bench: $(VENV)/.ready-bench driver ## the figures of docs/benchmarks.md, measured here
	@$(RUN) -m benchmarks $(ARGS)

studies: $(VENV)/.ready-bench driver ## the pages of docs/studies, measured here (ARGS="levels" for one)
	@$(RUN) -m benchmarks.studies $(ARGS)

pictures: $(VENV)/.ready-demo driver ## the pictures of docs/environments.md
	@$(RUN) tools/pictures.py

# One stamp for each set of packages, older than pyproject.toml when there is something to install.
$(VENV)/.ready-%: pyproject.toml tools/setup
	@tools/setup packages $(VENV) $*

driver: $(VENV)/.ready-demo
	@tools/setup driver $(VENV)

test-libraries: $(VENV)/.ready-demo
	@tools/setup test-libraries $(VENV)

clean: ## remove the environment and everything that was built
	rm -rf $(VENV) .venv-ci .venv-wheel build dist out
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find glbump tests benchmarks demos tools -name __pycache__ -type d -prune -exec rm -rf {} +
