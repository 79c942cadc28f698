# make demo    calibrate a gyroscope on a simulated robot arm, on a bare machine with Python
# make all-extras  what the optional parts of the commands need: pictures, PDF, parquet, ROS 2, shared history, debug probe
# make check   lint, types, import layers and the fast tests
# make test    everything CI checks: lint, types, import layers, all tests
# make proof   statistical acceptance over all seeds, which takes longer than anybody waits for a change
# make firmware builds the board's image (needs arm-none-eabi-gcc) and prints what it takes of the chip
# make bench   every benchmark, then a table of figures and goals (Error 3: one is a fifth behind); not faults, long_life, damaged_frames and hidden_worlds, which take hours
# make lock    pins what `make demo` installs anew, by version and hash (requirements/demo.txt)
# make sbom    what is installed, as a CycloneDX bill of materials: build/sbom.json
# make figures the pictures in docs/results.md, by the studies and the experiments
# make docs    the documentation as a site with a search: build/docs/index.html; a broken link is an error
# make drawings the drawings in docs/drawings: wiring, axes, a sweep
# What the machine itself lacks for one of them, requirements/system.sh installs on Debian, or names.

VENV := .venv
BIN := $(VENV)/bin
LONG := benchmarks/wire/damaged_frames.py $(addprefix benchmarks/laboratory/, faults.py long_life.py hidden_worlds.py)
STUDIES := normal extreme speed convergence sine averaging estimators misalignment budget kvh-gyro kvh-accelerometer

.PHONY: demo all-extras system check fast test whole kernels proof lint firmware bench lock sbom figures docs drawings clean
.DELETE_ON_ERROR:

# Every test starts processes, thousands in all: what Python compiled for one it keeps for the next, also where a container
# says that it should not.
unexport PYTHONDONTWRITEBYTECODE

demo: $(VENV)/demo.installed
	$(BIN)/rig run configs/demo.yaml
	@echo "make all-extras installs what else the commands can use: pictures, PDF, parquet, ROS 2, shared history, debug probe" >&2

all-extras: $(VENV)/all.installed

# Fast tests compute, so two run at a time on two processors; of all tests three, as many wait for a laboratory: every
# simulated one has a loopback address of its own. With four, each takes an eighth more processor time from the others.
# As many threads for linear algebra would only be in each other's way. Hypothesis' plugins would import the whole of trio.
PYTEST = OPENBLAS_NUM_THREADS=1 HYPOTHESIS_NO_PLUGINS=1 $(BIN)/pytest -n $(AT_A_TIME) --dist $(DIST)
AT_A_TIME := 2
DIST := worksteal

# Linear algebra rounds by its kernel, which is chosen by the processor. `make test` solves one recording for each kind of
# fit by another kernel too, that of every processor without AVX-512; `make proof` runs all numeric tests by it and by that
# of processors without AVX, from before 2011.
FROZEN := -n 0 -m "kernels or not (slow or proof)" $(wildcard tests/*/test_recordings*.py)
EACH_FIT := six_observation or earth_rate or imu or thermal or by_hand
NUMERIC := $(FROZEN) tests/estimation tests/notebook tests/history/test_store.py

system:
	requirements/system.sh test

# Lint runs beside the tests, and ends before them.
check: system $(VENV)/dev.installed
	$(MAKE) --jobs=2 lint fast

# All of it once, and what is linted and solved by another kernel meanwhile.
test: system $(VENV)/dev.installed
	$(MAKE) --jobs=2 kernels whole

# What a test file is rewritten to for its assertions is kept. The first time it is made here, not by each of them.
build/collected.txt: | $(VENV)/dev.installed
	mkdir -p build && $(BIN)/pytest --collect-only --quiet > $@

fast: build/collected.txt $(VENV)/dev.installed
	$(PYTEST) -m "not slow"

# A file's tests stay together: a whole run that several of them look at is made once. It takes a tenth less.
whole: AT_A_TIME := 3
whole: DIST := loadfile --no-loadscope-reorder
whole: build/collected.txt $(VENV)/dev.installed
	rm -rf build/coverage
	RIG_COVERAGE=$(CURDIR)/build/coverage $(PYTEST)
	$(MAKE) -C firmware_host/firmware coverage_table COVERED=$(CURDIR)/build/coverage PYTHON=$(CURDIR)/$(BIN)/python

kernels: lint build/collected.txt
	OPENBLAS_CORETYPE=Haswell $(PYTEST) $(FROZEN) -k "$(EACH_FIT)"

proof: AT_A_TIME := 4
proof: system $(VENV)/dev.installed
	$(PYTEST) -m "proof or thorough or one_in" --proof -rP
	OPENBLAS_CORETYPE=Haswell $(PYTEST) $(NUMERIC)
	OPENBLAS_CORETYPE=Prescott $(PYTEST) $(NUMERIC)

# Pyrefly counts its own memory ten times a second, by every page of it: large pages are fewer.
LARGE_PAGES := _RJEM_MALLOC_CONF=thp:always,metadata_thp:always

lint: $(VENV)/dev.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(LARGE_PAGES) $(BIN)/pyrefly check
	$(BIN)/lint-imports

bench: $(VENV)/dev.installed
	$(BIN)/python benchmarks/goals.py $(filter-out $(LONG), $(wildcard benchmarks/*/*.py))

figures: $(VENV)/dev.installed
	for study in $(STUDIES); do $(BIN)/rig study $$study --jobs 2 --out build/studies || exit 1; \
	  cp build/studies/$$study.png docs/figures/; done
	for experiment in lsm9ds1 mpu9250; do rm -rf build/$$experiment; \
	  $(BIN)/rig run configs/$${experiment}_adis16465.yaml --out build/$$experiment || exit 1; \
	  for when in before after; do \
	    cp build/$$experiment/verification_gyro_$$when.png docs/figures/instruments/$$experiment-$$when.png; done; done
	for run in earth:earth_rate drift:bias_drift; do rm -rf build/kvh1775_$${run%%:*}; \
	  $(BIN)/rig run configs/own_port/kvh1775_$${run%%:*}.yaml --out build/kvh1775_$${run%%:*} || exit 1; \
	  cp build/kvh1775_$${run%%:*}/$${run##*:}_kvh.png docs/figures/instruments/kvh1775-$${run%%:*}.png; done

docs: $(VENV)/docs.installed
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet -d build/doctrees -c docs/site . build/docs
	@echo "build/docs/index.html"

drawings: $(VENV)/demo.installed
	$(BIN)/python docs/drawings/draw.py

firmware: $(VENV)/demo.installed
	$(MAKE) -C firmware_host/firmware
	$(BIN)/python -m firmware_host.footprint

# Tools of a release, beside what is installed for the program itself.
TOOLS := build/tools

lock: | $(TOOLS)/bin/uv
	$(TOOLS)/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --extra world \
	  --custom-compile-command "make lock" --output-file requirements/demo.txt pyproject.toml requirements/demo.in

sbom: $(VENV)/demo.installed | $(TOOLS)/bin/cyclonedx-py
	$(TOOLS)/bin/cyclonedx-py environment --pyproject pyproject.toml --output-reproducible --of JSON \
	  --output-file build/sbom.json $(BIN)/python

$(TOOLS)/bin/uv: TOOL := $(file < requirements/uv.txt)
$(TOOLS)/bin/cyclonedx-py: TOOL := cyclonedx-bom==7.5.0
$(TOOLS)/bin/uv $(TOOLS)/bin/cyclonedx-py: | $(BIN)/python
	$(BIN)/python -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check $(TOOL)

clean:
	rm -rf $(VENV) build/python build/tools build/wheels build/collected.txt *.egg-info

$(BIN)/python:
	requirements/environment.sh $(VENV)

# From the lock file: the same versions, byte for byte, whenever it is. `dev` takes the newest that pyproject.toml allows.
$(VENV)/demo.installed: pyproject.toml requirements/demo.txt | $(BIN)/python
	@echo "make: installing the program into $(VENV), about a minute; only the first time" >&2
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements/demo.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/docs.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@

$(VENV)/all.installed: pyproject.toml | $(VENV)/demo.installed
	@echo "make: installing all optional parts into $(VENV), about a minute; only the first time" >&2
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[all]'
	@touch $@

$(VENV)/dev.installed: pyproject.toml | $(BIN)/python
	@echo "make: installing the program and all that its tests need into $(VENV), about two minutes; only the first time" >&2
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@ $(VENV)/demo.installed $(VENV)/all.installed $(VENV)/docs.installed
