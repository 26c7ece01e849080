# make run      set up, then the whole chain for the library craft "hokie"
# make test     set up, then lint, types, layers and tests
# make help     the other targets
# Needs python3 (3.11 or newer), gcc and make. Everything is installed into .venv/; the engine is compiled on the way.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
JOBS   ?= $(shell nproc 2>/dev/null || echo 2)
OUT    ?= hokie
ENGINE := hatch_build.py $(wildcard src/towtank/symbols.py src/towtank/engine/*.py src/towtank/engine/c/* \
            src/towtank/model/*.py src/towtank/pilot/*.py)

.PHONY: help install openfoam run test lint bench bench-engine bench-derive bench-robust bench-calibrate validate validate-slurm validate-openfoam clean
.DEFAULT_GOAL := help

help:
	@echo "make install   the package into $(VENV)/, its engine compiled; the command is $(BIN)/towtank"
	@echo "make openfoam  OpenFOAM by apt-get, as root, on Debian or Ubuntu; the tests need it"
	@echo "make run       towtank run hokie, results in ./$(OUT)"
	@echo "make test      ruff, mypy, import-linter, pytest"
	@echo "make lint      the first three of these"
	@echo "make validate  the longer checks; rewrites the tables in validation/ and that of the report"
	@echo "make validate-slurm  work shared by jobs of a real one-node Slurm; as root, with Debian's Slurm installed"
	@echo "make validate-openfoam  SUBOFF by RANS, one change of set-up at a time, with and without fins, on three meshes, overset; three hours"
	@echo "make bench     time and memory of the whole chain, written to bench/run.json"
	@echo "make bench-engine  the engine against the machine's peak, written to bench/engine.json"
	@echo "make bench-derive  identification of 200 runs of 2000 samples, written to bench/derive.json"
	@echo "make bench-robust  1000 drawn craft through all trials and requirements, written to bench/robust.json"
	@echo "make bench-calibrate  10 records of 30 min at 10 Hz, 30 coefficients, written to benchmarks/calibrate.json"
	@echo "make clean     remove $(VENV)/, caches and bench/"

install: $(VENV)/.engine

$(VENV)/.installed: pyproject.toml .ci/venv.sh
	bash .ci/venv.sh "$(PYTHON)" "$(VENV)"
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

# The installation compiles the engine; it is compiled again after its sources changed.
$(VENV)/.engine: $(ENGINE) | $(VENV)/.installed
	@[ -z "$$(find $(ENGINE) -newer $(VENV)/.installed)" ] || $(BIN)/python -m pip install --quiet --no-deps --editable .
	@touch $@

$(VENV)/.tools: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --group dev
	@touch $@

openfoam:
	@bash .ci/openfoam.sh

run: $(VENV)/.engine
	$(BIN)/towtank run hokie --out "$(OUT)"

lint: $(VENV)/.tools
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	OMP_NUM_THREADS=1 $(BIN)/pytest -m "not validate and not slurm" -n $(JOBS) --dist loadfile

validate: $(VENV)/.tools
	$(BIN)/python validation/suboff.py
	OMP_NUM_THREADS=1 $(BIN)/python validation/interval_coverage.py
	$(BIN)/python validation/prediction.py
	OMP_NUM_THREADS=1 $(BIN)/python validation/calibrate_twin.py
	$(BIN)/pytest -m validate

validate-slurm: $(VENV)/.engine $(VENV)/.tools
	$(BIN)/pytest -m slurm

validate-openfoam: $(VENV)/.tools
	$(BIN)/python validation/openfoam_suboff.py
	$(BIN)/python validation/openfoam_slopes.py
	$(BIN)/python validation/openfoam_grid.py
	$(BIN)/python validation/openfoam_overset.py

bench: $(VENV)/.engine
	$(BIN)/python benchmarks/bench.py

bench-engine: $(VENV)/.engine $(VENV)/.tools
	$(BIN)/python benchmarks/engine.py

bench-derive: $(VENV)/.engine
	$(BIN)/python benchmarks/derive.py

bench-robust: $(VENV)/.engine
	$(BIN)/python benchmarks/robust.py

bench-calibrate: $(VENV)/.engine
	OMP_NUM_THREADS=1 $(BIN)/python benchmarks/calibrate.py

clean:
	rm -rf $(VENV) bench build dist src/towtank/engine/lib .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
