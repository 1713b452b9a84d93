# Every target does its own set-up (setup.sh says what it installs) and is quick when all is there.
.PHONY: setup-peers setup-docs demo demo-rigid docs test test-all test-lowest test-rest lint bench validate setup

bin := .venv/bin
lowest := .venv-lowest
two := -n 2 --dist worksteal
until := inf # seconds after which `make test-rest` begins no test

setup:
	@./setup.sh

demo: setup
	$(bin)/trackbed run trackbed/scenes/karrech-coarse.toml --fast --members 2 --control \
		--run-folder demo-bed/run
	$(bin)/trackbed report demo-bed/run --open
	$(bin)/trackbed status demo-bed/run

demo-rigid: setup
	$(bin)/trackbed rigid trackbed/scenes/pile.toml --run-folder demo-pile --resume \
		--set run.duration=0.95 --set run.frames=19
	@echo "now look at demo-pile/report.html and demo-pile/movie.gif"

# What anyone can run in five minutes, half of it compiling: no long test, no study, no engine, no peer.
test:
	@./setup.sh test
	$(bin)/python -m pytest $(two) -m "not (long or engine or peer or studies or validate)"

# Everything, where a library or an engine that is missing fails its tests.  40 minutes.
test-all: test test-lowest test-rest

test-lowest: setup $(lowest)/made # some tests with the lowest versions that pyproject.toml allows; on Python 3.11 or 3.12
	NUMBA_CACHE_DIR=$(lowest)/kernels $(lowest)/bin/python -m pytest $(two) -m lowest \
		-W ignore::DeprecationWarning # of old libraries against new ones below them

$(lowest)/made: tests/lowest.txt pyproject.toml
	$${PYTHON:-python3} -m venv --clear $(lowest)
	$(lowest)/bin/python -m pip install --quiet --disable-pip-version-check \
		-c tests/lowest.txt -e ".[test]"
	touch $@

setup-peers:
	@./setup.sh test,peers

test-rest: setup-peers # what `make test` left out or skipped, with the newest versions that pip finds
	$(bin)/python -m pytest $(two) --nothing-missing --begin-until $(until) \
		-m "(long or studies or engine or peer) and not validate"

pictures := $(patsubst %.py,%.png,$(wildcard docs/gallery/*.py))

docs: setup-docs $(pictures) # build/site/index.html; a link that leads nowhere fails
	$(bin)/python -m mkdocs build

setup-docs:
	@./setup.sh docs

docs/gallery/%.png: docs/gallery/%.py | setup-docs
	PYTHONPATH=. $(bin)/python $< $@

lint:
	@./setup.sh lint
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/mypy

bench:
	@./setup.sh bench
	$(bin)/python -m validation.study qdem-cost run --only speed

validate:
	@./setup.sh test
	for study in $$($(bin)/trackbed validate); do $(bin)/trackbed validate $$study || exit; done
