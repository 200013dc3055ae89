# make demo   from nothing to modal files, reports and a simulated pendulum
# make test   all tests
# make docs   the documentation, in build/site
PYTHON ?= python3
VENV := .venv
PIP := $(VENV)/bin/python -m pip --quiet --disable-pip-version-check

.PHONY: demo test docs clean

demo: $(VENV)/.installed
	$(VENV)/bin/modalprep run pipelines/spinup-beam.toml
	$(VENV)/bin/modalprep run pipelines/bracket.toml
	$(VENV)/bin/modalprep run pipelines/satellite.toml
	$(VENV)/bin/modalprep simulate pipelines/bracket-pendulum.toml
	@echo "Modal files, reports and pictures are in pipelines/output/."

# Hundreds of tests start processes of their own, which need not compile the sources to bytecode again.
test: $(VENV)/.installed-test
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 $(VENV)/bin/pytest --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder

docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --strict
	@echo "The documentation is in build/site/index.html."

# With the extras $(1), while the solver is compiled.
define install
	@$(PYTHON) .ci/system-libraries
	@echo "Installing modalprep and its libraries into $(VENV), a few minutes and 2.4 GB the first time."
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) install --editable .
	@echo "Compiling the solver while the libraries of the extras are installed."
	@PYTHONPATH=src $(VENV)/bin/python -c 'from modalprep.cli.jobs import warmup; warmup()' & \
	$(PIP) install --editable '.[$(1)]' && wait $$!
endef

$(VENV)/.installed: pyproject.toml
	$(call install,all)
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	@$(PIP) install --editable '.[all,test]'
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	@$(PIP) install --editable '.[all,docs]'
	@touch $@

# All at once, which the checks of .ci/run need.
EVERYTHING := all,test,docs
$(VENV)/.installed-all: pyproject.toml
	$(call install,$(EVERYTHING))
	@touch $(VENV)/.installed $(VENV)/.installed-test $(VENV)/.installed-docs $@

clean:
	rm -rf $(VENV)
