PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
KERNELS := $(VENV)/kernels

# Where Python may not keep what it has read, every command would read torch anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo test lint coverage hooks faults bench check docs picture results reference clean

help: ## what can be made
	@grep -hE '^[a-zA-Z0-9_-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(KERNELS) ## a virtual environment with the package and its tests' needs, and the kernels compiled

# Python compiles what is imported, when it is; pip would compile all that is installed, which takes a minute more.
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; assert (3, 11) <= sys.version_info < (3, 14), "Python 3.11 to 3.13 is needed; name one: make PYTHON=python3.12 ..."'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --no-compile --constraint constraints.txt --editable '.[dev]'
	touch $(READY)

$(KERNELS): $(READY)
	$(BIN)/berteam train experiment=quickstart epochs=2 evaluation.games=0 out=build/first on_exists=overwrite > build.log
	rm -r build/first build.log
	touch $(KERNELS)

demo: setup ## the main job, small: train, then look at what came of it
	$(BIN)/berteam train experiment=quickstart selector=mcaa optimizer=mapelites

# A file's tests in one process, and files in their order: what they share is made once, and the long ones come early.
BY_FILE := --dist loadfile --no-loadscope-reorder

test: ## style, types and all tests
	$(MAKE) --jobs=2 lint setup
	$(BIN)/python -m pytest --numprocesses 2 $(BY_FILE)

lint: $(READY) ## style (ruff) and types (mypy)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

coverage: setup ## all tests, and which lines of the packages they run
	$(BIN)/python -m pytest --numprocesses 2 $(BY_FILE) --cov --cov-report term

hooks: setup ## style and types checked at each commit, by pre-commit
	$(BIN)/pre-commit install

faults: setup ## kills, full disks, damaged checkpoints, wrong command lines: what a run survives, in some twenty minutes
	$(BIN)/python -m tests.faults

bench: setup ## speed: figures, targets and ratios
	$(BIN)/python -m tests.bench

check: setup ## replays the recorded games
	$(BIN)/python -m mctf.check tests/traces/*.npz tests/traces/*.csv

docs: setup ## the page of every config key
	$(BIN)/python docs/config_reference.py docs/config.md

picture: setup ## the pictures of the README and docs
	$(BIN)/berteam train experiment=paper_fixed out=outputs/picture on_exists=overwrite
	$(BIN)/python docs/picture.py outputs/picture docs/picture.png
	$(BIN)/python docs/field.py docs/field.png
	$(BIN)/python docs/results/course.py docs/results/course.png

SMALL := outputs/results_small
BOTH := hydra/launcher=joblib hydra.launcher.n_jobs=2

results: setup ## docs/results.md, small: four levers, three seeds, and selectors on the same members, in some twenty minutes
	$(BIN)/berteam sweep docs/results/small.yaml $(BOTH) hydra.sweep.dir=$(SMALL)/levers
	$(BIN)/berteam sweep docs/results/selection.yaml $(BOTH) hydra.sweep.dir=$(SMALL)/selection epochs=100 evaluation.games=2800 evaluation.games_per_pair=10 population.run=$(SMALL)/levers/0,$(SMALL)/levers/1,$(SMALL)/levers/2
	$(BIN)/python docs/results/tables.py $(SMALL)/levers
	$(BIN)/python docs/results/levers.py $(SMALL)/levers
	$(BIN)/python docs/results/selection.py $(SMALL)/selection

reference: setup ## the Elos of the fixed teams that the package ships
	$(BIN)/berteam tournament out=outputs/reference on_exists=overwrite
	cp outputs/reference/elo.csv berteam_cli/rating/$$($(BIN)/python -c 'import json; print(json.load(open("outputs/reference/manifest.json"))["reference"])')

clean: ## removes the environment and what tests leave; run folders stay
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .hypothesis .ruff_cache .mypy_cache .coverage*
	find . -name __pycache__ -prune -exec rm -rf {} +
