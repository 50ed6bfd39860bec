# bakery: `make help` lists what there is.

# The first Python that runs and is new enough; a name on the PATH may be an empty shim.
PYTHON ?= $(shell for p in python3 python3.11 python3.12 python3.13 python3.14; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
RUN = $(VENV)/bin
READY = $(VENV)/.ready
SAMPLE ?= samples/chidi.jpg
DEMO = demo.avatar
PHOTOS ?= samples
OUT ?= avatars
JOBS ?= 1
FLAGS ?=
COUNT ?= 50000
KIND ?=
# glibc gives freed arrays back to the system and asks for them again: 7:28 to 7:58 minutes of tests
# with these, 8:11 without, on one day of a host whose speed varies.
KEEP_MEMORY = MALLOC_TRIM_THRESHOLD_=1000000000 MALLOC_MMAP_THRESHOLD_=33554432

.PHONY: help setup demo test proofs clients fuzz campaign lock lint golden bench report docs cli avatars samples picture viewer clean
.DEFAULT_GOAL := help

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  \1|/' | column -t -s '|'

setup: $(READY) ## create .venv and install everything

$(READY): pyproject.toml
	@test -n '$(PYTHON)' || { echo 'Python 3.11 or newer is needed: make PYTHON=/path/to/python3'; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(RUN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	$(RUN)/bakery doctor --warm
	@touch $@

demo: $(READY) ## bake a sample portrait and say where its picture is
	@$(RUN)/bakery build --overwrite -o $(DEMO) -- '$(SAMPLE)'
	@$(RUN)/bakery validate $(DEMO)
	@echo 'preview: $(CURDIR)/$(DEMO)/preview.png'

test: $(READY) ## run the tests, for two cores
	PYTHONDONTWRITEBYTECODE= $(KEEP_MEMORY) $(RUN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder

proofs: $(READY) ## run the long proofs, minutes each
	$(RUN)/python -m pytest -m slow

clients: $(READY) ## show head.glb and USD in Blender, three.js, Babylon, PlayCanvas, model-viewer (1.3 GB to download)
	$(RUN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target .work/clients bpy==5.0.1
	npm install --prefix .work/clients --silent --no-audit --no-fund \
		babylonjs@9.35.0 babylonjs-loaders@9.35.0 playcanvas@2.23.3 @google/model-viewer@4.4.0
	cd bakery/runtime/viewer && npm ci --silent --no-audit --no-fund
	PYTHONPATH=.work/clients $(RUN)/python -m pytest tests/clients

fuzz: $(READY) ## read damaged files: COUNT=50000 of each kind, or only KIND="exr take"
	$(RUN)/python tests/fuzz $(COUNT) $(KIND)

campaign: $(READY) ## kill, starve and lie to bakery, an hour and more: SHARE=0.01 for a hundredth, ROWS='"kill -9"' for some
	$(RUN)/python tests/campaign $(ROWS) --share $(or $(SHARE),1) --keep .work/campaign.json --write

lock: $(READY) ## pin all dependencies with their hashes, in docs/requirements.lock
	$(RUN)/python -m pip install --quiet --disable-pip-version-check --target .work/uv uv
	.work/uv/bin/uv pip compile pyproject.toml --universal --generate-hashes --no-emit-index-url --no-header --quiet --output-file docs/requirements.lock

lint: $(READY) ## check style, types and spelling
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/mypy
	$(RUN)/typos bakery tests docs README.md CHANGELOG.md Makefile

golden: $(READY) ## accept today's pictures as the golden ones
	UPDATE_GOLDEN=1 $(RUN)/python -m pytest tests/golden tests/web

bench: $(READY) ## measure speed and memory; append a line to tests/bench/results.csv
	$(RUN)/python tests/bench/bench.py '$(SAMPLE)'

report: $(READY) ## measure again what needs no photographs, into docs/quality.md; ONLY="speed web" takes groups
	$(RUN)/python docs/report.py $(ONLY)

cli: $(READY) ## write docs/cli.md from the commands
	$(RUN)/python docs/cli.py

docs: $(READY) ## build the documents as a site in build/site
	$(RUN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	$(RUN)/mkdocs build --strict --quiet -f docs/site/mkdocs.yml
	@echo 'site: $(CURDIR)/build/site/index.html'

avatars: $(READY) ## bake the portraits of PHOTOS=folder into OUT=folder, JOBS=2 at once; fresh ones are skipped
	@$(RUN)/bakery build '$(PHOTOS)' -o '$(OUT)/' --jobs '$(JOBS)' --overwrite $(FLAGS)

samples: $(READY) ## paint the synthetic portraits of samples/ again
	$(RUN)/bakery synth samples -o samples --overwrite

picture: $(READY) ## draw docs/avatars.jpg, the picture of README, again
	$(RUN)/python docs/avatars.py

viewer: ## build the page of `bakery preview` again (needs node and npm)
	cd bakery/runtime/viewer && npm ci --no-audit --no-fund --silent && npm run --silent build

clean: ## remove what was built
	rm -rf $(VENV) $(DEMO) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache node_modules
