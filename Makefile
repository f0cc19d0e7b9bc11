# Every target does its own set-up (scripts/setup.sh); a second call finds it done.
export ROBOT ?= config/renda2021.yaml
IN_ENV := scripts/in_env.sh

.DEFAULT_GOAL := help
.PHONY: help setup demo run test soak bench lint site clean

help: ## show this list
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 15

setup: ## ROS 2 (sourced, or a venv), the built workspace and the compiled kernels
	@scripts/setup.sh

demo: setup ## stream the two sweeps of Fig. 4 through the node, check every tip, draw demo/fig4.png
	@$(IN_ENV) sweep_demo --output demo

run: setup ## serve equilibria until Ctrl-C; another robot: make run ROBOT="its file.yaml"
	@$(IN_ENV) equilibrium_node --ros-args --params-file config/equilibrium_node.yaml -p "robot_file:='$$ROBOT'"

lint: setup ## style, format and types
	@$(IN_ENV) python3 -m ruff check .
	@$(IN_ENV) python3 -m ruff format --check .
	@$(IN_ENV) python3 -m mypy

site: ## the documentation as a site, every link checked: .site/index.html
	@scripts/site.sh

# Tests that keep time have the machine to themselves; the others share the processors.
test: lint site ## lint, the site, solver tests and node tests
	@$(IN_ENV) python3 -m pytest -m "not soak and not alone" -n 2 --dist loadfile
	@$(IN_ENV) python3 -m pytest -m "not soak and alone"

soak: setup ## the long tests; SOAK_MINUTES=1 shortens the longest of them, 10 minutes of load
	@$(IN_ENV) python3 -m pytest -m soak

bench: setup ## speed against accuracy, measured here and charted: docs/speed_accuracy.*, docs/cost_growth.*, docs/loaded_cost.*
	@$(IN_ENV) python3 -m bench.speed.speed_accuracy
	@$(IN_ENV) python3 -m bench.growth.cost_growth
	@$(IN_ENV) python3 -m bench.serving.serving_cost
	@$(IN_ENV) python3 -m bench.serving.hard_cases
	@$(IN_ENV) python3 -m bench.accuracy.effectivity
	@$(IN_ENV) python3 -m bench.accuracy.loaded_effectivity
	@$(IN_ENV) python3 -m bench.loads.loaded_cost
	@$(IN_ENV) python3 -m bench.node.node_latency

clean: ## remove everything that make has made, compiled kernels in the user's cache among it
	@for venv in .venv .venv-sourced; do \
		$$venv/bin/python3 -m ctr_pvs.kernel --remove 2>/dev/null | sed 's/^/rm -rf /' || true; done
	rm -rf .venv .ws .venv-sourced .ws-sourced .venv-site .site demo .mypy_cache .pytest_cache .ruff_cache
	find bench ctr_pvs ctr_pvs_ros test -name __pycache__ -prune -exec rm -rf {} +
	@echo "the next make sets up anew and compiles the kernels again, which takes some minutes"
