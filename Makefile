# Daily commands; `make` alone lists them. CI calls the same ones (.ci/run).
#
# One environment, .venv, with spacearm installed editable: a changed Python file is seen at once, a changed kernel file
# (or a new or removed Python file) rebuilds what it must. Stamp files inside .venv say what is up to date, so deleting
# .venv resets everything.
SHELL = /bin/sh
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

VENV := .venv
PY := $(VENV)/bin/python
PIP := $(PY) -m pip --disable-pip-version-check --quiet
STAMPS := $(VENV)/stamps
BENCH ?= --quick --install
WORKERS ?= 2

export PYTHON
export PYRIGHT_PYTHON_IGNORE_WARNINGS = 1

CXX_FILES := $(wildcard kernel/*.c kernel/*.cpp kernel/*.hpp kernel/*/*.cpp kernel/*/*.hpp benchmarks/*.cpp)
BUILD_FILES := pyproject.toml CMakeLists.txt $(CXX_FILES)
CLANG_FORMAT := $(VENV)/bin/clang-format

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo 'PYTHON=/path/to/python3 chooses the interpreter when .venv is made; rm -rf .venv starts afresh.'

demo: $(STAMPS)/package ## everything from nothing: environment, build, the paper's experiment and its report into out/
	@out=$$(sh tools/fresh_folder.sh out/paper) && echo "Running the paper's experiment into $$out." && \
	  $(VENV)/bin/spacearm paper -o "$$out" && sh tools/open_page.sh "$$out/report.html"

# With compiled modules kept, whatever the user's shell says of them: many tests start programs.
test: $(STAMPS)/package $(STAMPS)/test ## environment, build, and all tests
	@echo 'Running the tests.'
	@PYTHONDONTWRITEBYTECODE= $(PY) -m pytest -n $(WORKERS) --dist loadfile

lint: $(STAMPS)/package $(STAMPS)/lint ## format check, lint, and types
	@failed=; \
	  echo 'ruff format --check'; $(PY) -m ruff format --check . || failed="$$failed format"; \
	  echo 'clang-format';        $(CLANG_FORMAT) --dry-run -Werror $(CXX_FILES) || failed="$$failed clang-format"; \
	  echo 'ruff check';          $(PY) -m ruff check . || failed="$$failed check"; \
	  echo 'pyright';             $(PY) -m pyright || failed="$$failed pyright"; \
	  if [ -n "$$failed" ]; then echo "Lint failed:$$failed (make format mends the first three where it can)."; exit 1; fi; \
	  echo 'Lint passed.'

format: $(STAMPS)/lint ## rewrite the Python and C++ files in the house's format
	@$(PY) -m ruff check --fix --exit-zero --quiet . ; $(PY) -m ruff format . ; $(CLANG_FORMAT) -i $(CXX_FILES)

# Reads docs/ and the docstrings; needs no network. Warnings are errors.
docs: $(STAMPS)/package $(STAMPS)/docs ## the site, into build/site
	@echo 'Building the site.'
	@$(PY) -m sphinx --quiet --fail-on-warning --keep-going --fresh-env --write-all \
	  --builder html --doctree-dir build/site-pages docs build/site
	@echo 'The site is in build/site/index.html.'

bench: $(STAMPS)/package ## the swarm beside other libraries (BENCH="--quick --install"), one environment each
	@$(PY) benchmarks/paper_numpy.py
	@$(PY) benchmarks/compare_swarms.py $(BENCH)

# Repaired on Linux, so that the wheel runs on other distributions; what it was built with decides how old they may be.
wheel: $(STAMPS)/package $(STAMPS)/wheel ## a wheel into dist/, tried in a fresh environment without a compiler
	@rm -rf build/wheel && mkdir -p build/wheel dist
	@$(PIP) wheel --no-deps --no-build-isolation --config-settings=cmake.define.SPACEARM_WERROR=ON -w build/wheel .
	@if [ "$$(uname)" = Linux ]; then PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(PY) -m auditwheel repair -w build/wheel/repaired \
	    build/wheel/*.whl > build/wheel/auditwheel.log 2>&1 || { cat build/wheel/auditwheel.log; exit 1; }; \
	  else mkdir -p build/wheel/repaired && cp build/wheel/*.whl build/wheel/repaired; fi
	@wheel=$$(ls build/wheel/repaired/*.whl) && $(PY) tools/check_wheel.py "$$wheel" && cp "$$wheel" dist/ && echo "dist/$$(basename "$$wheel")"

clean: ## remove what was built or cached; .venv and out/ stay
	rm -rf build dist .pytest_cache .ruff_cache .hypothesis
	find . -path './.venv*' -prune -o -path ./.git -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

# ---- the environment -------------------------------------------------------------------------------------------------

# What the build needs stays in .venv (no isolated build), so that a rebuild compiles only what changed.
$(STAMPS)/tools: pyproject.toml tools/preflight.sh tools/requirements.py
	@python=$$(sh tools/preflight.sh $(VENV)) || exit 2; \
	  if [ -x $(PY) ]; then echo 'Bringing the environment $(VENV) up to date.'; \
	  else echo 'Making the environment $(VENV) and building spacearm: about 4 minutes the first time.'; fi; \
	  [ -x $(PY) ] || "$$python" -m venv $(VENV) || exit 2; \
	  $(PY) -m pip --version > /dev/null 2>&1 || $(PY) -m ensurepip > /dev/null || exit 2
	@mkdir -p $(STAMPS)
	@$(PIP) install 'pip>=23.1'
	@$(PY) tools/requirements.py build > $(STAMPS)/build.txt && $(PIP) install -r $(STAMPS)/build.txt
	@touch $@

$(STAMPS)/package: $(STAMPS)/tools $(STAMPS)/modules $(BUILD_FILES)
	@sh tools/preflight.sh $(VENV) > /dev/null || exit 2
	@echo 'Building the kernel and installing spacearm: about 1 minute on 2 cores, seconds if little changed.'
	@$(PIP) install --no-build-isolation --config-settings=cmake.define.SPACEARM_WERROR=ON --editable .
	@touch $@

$(STAMPS)/test $(STAMPS)/lint $(STAMPS)/docs $(STAMPS)/wheel: $(STAMPS)/%: $(STAMPS)/tools pyproject.toml
	@echo 'Installing what make $* needs: about half a minute.'
	@$(PY) tools/requirements.py run $* > $(STAMPS)/$*.txt && $(PIP) install -r $(STAMPS)/$*.txt
	@touch $@

# The names of the Python files: an editable install has to be told of a new one.
$(STAMPS)/modules: $(STAMPS)/tools ALWAYS
	@find src -type f ! -path '*/__pycache__/*' | LC_ALL=C sort > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

.PHONY: help demo test lint format docs bench wheel clean ALWAYS
