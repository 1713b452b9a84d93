# Every target does its own set-up (setup.sh says what it installs) and is quick when all is there.
.PHONY: demo demo-rigid test lint bench validate setup

bin := .venv/bin

setup:
	@./setup.sh

demo: setup
	$(bin)/trackbed run scenes/karrech-coarse.toml --control --run-folder demo-bed/run
	$(bin)/trackbed report demo-bed/run --open
	$(bin)/trackbed status demo-bed/run

demo-rigid: setup
	$(bin)/trackbed rigid scenes/pile.toml --run-folder demo-pile --resume \
		--set run.duration=0.95 --set run.frames=19
	@echo "now look at demo-pile/report.html and demo-pile/movie.gif"

test:
	@./setup.sh test
	$(bin)/python -m pytest -n 2 --dist worksteal --long-until 600

lint:
	@./setup.sh lint
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/mypy

bench:
	@./setup.sh bench
	$(bin)/trackbed validate dump-speed
	$(bin)/python -m validation.study qdem-cost run --only speed

validate:
	@./setup.sh test
	for study in $$($(bin)/trackbed validate); do $(bin)/trackbed validate $$study || exit; done
