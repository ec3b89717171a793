# What can be done with the project from a shell. `make test` is the whole gate: it needs Rust with
# rustfmt and clippy, Python 3.9 or later, Node 20.19, 22.12 or later, Chromium, curl, and the
# package indices; nothing else.

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
# Cargo uses all cores by itself, and its steps would only wait for one another.
.NOTPARALLEL:

PYTHON ?= python3
VENV := $(CURDIR)/.venv
TARGET := $(abspath $(or $(CARGO_TARGET_DIR),target))
CLIENT := clients/python
PEERS := tests/peers
DASHBOARD := clients/dashboard
PAGE := target/dashboard/index.html
BROWSER := tests/browser
# Debian's, or another one that is named here.
export CHROMIUM ?= chromium
AS_ROOT := $(shell [ $$(id -u) = 0 ] || echo sudo --non-interactive)

# A clean clone is built once: what would make a second build faster only fills its disk.
ifdef CI
export CARGO_INCREMENTAL := 0
endif

# The end-to-end tests of both languages start this binary.
export COGMAP_BIN := $(TARGET)/debug/cogmap

# Every step over the workspace names all of its targets, and so gets the same features of every
# dependency: Zenoh is then built once, not once for each step. `--locked` builds the versions of
# Cargo.lock, and fails where the manifests ask for others. The store on object storage, a feature,
# is tested with all else; that the rest does without it is left to the lints.
FEATURES := --features cogmap/object-storage
ALL := --locked --workspace --all-targets $(FEATURES)

# nextest runs the tests of all crates at once; without it, cargo's own runner does.
ifneq ($(shell command -v cargo-nextest),)
RUN_RUST_TESTS := cargo nextest run --locked --workspace $(FEATURES)
else
RUN_RUST_TESTS := cargo test --locked --workspace $(FEATURES) --lib --bins --tests
endif

.PHONY: help
help: ## list the targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

# The steps are lines of one recipe, because their order matters: what fails fastest comes first,
# and the summaries of the test runners come last.
.PHONY: test
test: needs-node needs-chromium ## the whole gate: format, lints, documentation, tests of Rust, of Python and in a browser
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	cargo clippy $(ALL) -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace $(FEATURES) --no-deps --lib --examples
	$(MAKE) --no-print-directory test-page test-rust test-python test-browser

.PHONY: test-rust
test-rust: ## tests of Rust, the end-to-end tests among them
	cargo build $(ALL)
	cargo test --locked --workspace $(FEATURES) --doc
	$(RUN_RUST_TESTS)

.PHONY: test-python
test-python: $(VENV)/installed ## types and tests of the Python client, then the end-to-end tests in Python
	cargo build $(ALL)
	cd $(CLIENT) && $(VENV)/bin/mypy --strict
	cd tests/python && $(VENV)/bin/mypy --strict .
	cd tests/scorecard && $(VENV)/bin/mypy --strict .
	cd tests/wheels && $(VENV)/bin/mypy --strict .
	cd tests/image && $(VENV)/bin/mypy --strict .
	cd tests/object_storage && $(VENV)/bin/mypy --strict .
	cd tests/cluster && $(VENV)/bin/mypy --strict .
	cd $(CLIENT) && $(VENV)/bin/pytest
	$(VENV)/bin/pytest tests/scorecard
	$(VENV)/bin/pytest tests/python

.PHONY: test-page
test-page: needs-node ## types, format, unit tests and size of the page
	$(MAKE) --no-print-directory dashboard
	cd $(DASHBOARD) && npm run check && npm test && npm run size

.PHONY: test-browser
test-browser: needs-node needs-chromium $(BROWSER)/.venv/installed ## the page in Chromium, of services that the tests start
	$(MAKE) --no-print-directory dashboard
	cargo build $(ALL)
	cd $(BROWSER) && .venv/bin/mypy --strict .
	$(BROWSER)/.venv/bin/pytest $(BROWSER)

.PHONY: needs-node
needs-node:
	@test -n '$(NODE_FITS)' || { \
	    echo 'The page is built with Node 20.19, 22.12 or later: install it.' >&2; exit 1; }

# Debian's package, where it may be installed; elsewhere whoever runs the tests is told what is
# missing.
.PHONY: needs-chromium
needs-chromium:
	@command -v $(CHROMIUM) >/dev/null || $(AS_ROOT) sh -c \
	    'apt-get update --quiet && apt-get install --quiet --yes chromium' || { \
	    echo 'There is no Chromium: apt-get install chromium, or CHROMIUM=/path/to/it.' >&2; \
	    exit 1; }

$(BROWSER)/.venv/installed: $(BROWSER)/requirements.txt $(CLIENT)/pyproject.toml
	$(PYTHON) -m venv --clear $(BROWSER)/.venv
	$(BROWSER)/.venv/bin/pip install --quiet --disable-pip-version-check \
	    --requirement $(BROWSER)/requirements.txt --editable $(CLIENT)
	touch $@

# A venv is made anew when what it has to hold changes.
$(VENV)/installed: $(CLIENT)/pyproject.toml
	$(PYTHON) -m venv --clear $(VENV)
	$(VENV)/bin/pip install --quiet --disable-pip-version-check \
	    --editable '$(CLIENT)[dev]' mypy pytest schemathesis
	touch $@

.PHONY: drills
drills: release ## attacks and faults that take minutes, as JSON; DRILLS="NAME…" for some of them
	COGMAP_BIN=$(TARGET)/release/cogmap \
	    cargo run --quiet --locked --package cogmap-tests --bin drills -- $(DRILLS)

# What `cargo fuzz` would set, without the sanitizers that need another compiler.
COVERAGE := -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg=fuzzing
FUZZ := $(CURDIR)/tests/fuzz
TARGETS ?= decode block checkpoint fold
SECONDS ?= 60

.PHONY: fuzz
fuzz: ## arbitrary bytes against all that reads bytes; TARGETS="fold" SECONDS=3600
	$(PYTHON) $(FUZZ)/seeds.py $(FUZZ)/corpus
	mkdir -p $(FUZZ)/artifacts
	host=$$(rustc -vV | sed -n 's/^host: //p'); cd $(FUZZ); \
	RUSTFLAGS="$(COVERAGE)" cargo build --release --target $$host --bins; \
	for target in $(TARGETS); do \
	    target/$$host/release/$$target -max_total_time=$(SECONDS) -max_len=65536 -timeout=60 \
	        -artifact_prefix=artifacts/$$target- corpus/$$target; \
	done

.PHONY: demo
demo: release ## the service with a simulated team of robots; ARGS="--robots 8 --duration 5m"
	$(TARGET)/release/cogmap demo $(ARGS)

.PHONY: serve
serve: release ## the service; ARGS="--config service/cogmap.toml"
	$(TARGET)/release/cogmap serve $(ARGS)

.PHONY: bench
bench: release-lab ## the benchmarks, each beside its yardstick; ARGS="--json"
	$(TARGET)/release/cogmap-lab bench step $(ARGS)
	$(TARGET)/release/cogmap-lab bench recall $(ARGS)
	$(TARGET)/release/cogmap-lab bench route $(ARGS)
	$(TARGET)/release/cogmap-lab bench descriptors $(ARGS)
	$(TARGET)/release/cogmap-lab bench touch --fold --objects 100,1000 $(ARGS)
	$(TARGET)/release/cogmap-lab bench ingest $(ARGS)
	$(TARGET)/release/cogmap-lab bench ingest --live 5 $(ARGS)
	$(TARGET)/release/cogmap-lab bench http $(ARGS)

.PHONY: scorecard
scorecard: release-lab ## figures of README and docs beside the committed card, half an hour; DATA=DIR with the data sets, ARGS="--quick", "--update"
	$(PYTHON) tests/scorecard/scorecard.py --binary $(TARGET)/release/cogmap \
	    $(if $(DATA),--data '$(DATA)') $(ARGS)

# Peers are large packages, so they have a venv of their own and no part in the gate.
.PHONY: peers
peers: release-lab $(PEERS)/.venv/installed ## cogmap beside its peers in the same run, for minutes; ARGS="--json" DATA=DIR with pose graphs, TOUCH=DIR with touched objects, TUC=DIR with place matches
	cd $(PEERS) && .venv/bin/mypy .
	$(PEERS)/.venv/bin/python $(PEERS)/recall.py --binary $(TARGET)/release/cogmap $(ARGS)
	$(PEERS)/.venv/bin/python $(PEERS)/gridness.py --binary $(TARGET)/release/cogmap $(ARGS)
	$(PEERS)/.venv/bin/python $(PEERS)/revisits.py --binary $(TARGET)/release/cogmap-lab $(ARGS)
ifdef DATA
	$(PEERS)/.venv/bin/python $(PEERS)/graphs.py --binary $(TARGET)/release/cogmap-lab $(ARGS) $(DATA)
endif
ifdef TOUCH
	$(PEERS)/.venv/bin/python $(PEERS)/touch.py --binary $(TARGET)/release/cogmap-lab $(ARGS) $(TOUCH)
endif
ifdef TUC
	$(PEERS)/.venv/bin/python $(PEERS)/closures.py $(ARGS) $(TUC)
endif

$(PEERS)/.venv/installed: $(PEERS)/requirements.txt $(PEERS)/judge.txt $(CLIENT)/pyproject.toml
	$(PYTHON) -m venv --clear $(PEERS)/.venv
	$(PEERS)/.venv/bin/pip install --quiet --disable-pip-version-check \
	    --requirement $(PEERS)/requirements.txt --editable $(CLIENT)
	$(PEERS)/.venv/bin/pip install --quiet --disable-pip-version-check \
	    --no-deps --requirement $(PEERS)/judge.txt
	touch $@

# The versions of Node that the page's build tool runs on; empty where there is no such Node.
NODE_FITS := $(shell node -p \
    '(([a, b]) => a > 22 || a == 22 && b >= 12 || a == 20 && b >= 19 ? 1 : "") \
    (process.versions.node.split(".").map(Number))' 2>/dev/null)
BUILDS_PAGE := $(and $(wildcard $(DASHBOARD)/package-lock.json),$(NODE_FITS))

.PHONY: dashboard
dashboard: $(if $(BUILDS_PAGE),$(PAGE)) ## the page that the service shows at /; needs Node 20.19, 22.12 or later
	$(if $(BUILDS_PAGE),,@echo 'The page is not built, and the service shows a plain one: \
	    that needs $(DASHBOARD) and Node 20.19, 22.12 or later.')

$(PAGE): $(shell find $(DASHBOARD) -name node_modules -prune -o -type f -print 2>/dev/null)
	cd $(DASHBOARD) && npm ci --no-audit --no-fund && npm run build
	touch $@

.PHONY: screenshot
screenshot: release needs-chromium $(BROWSER)/.venv/installed ## docs/images/dashboard.png, of the page of a demo
	$(BROWSER)/.venv/bin/python $(BROWSER)/screenshot.py --binary $(TARGET)/release/cogmap \
	    --out docs/images/dashboard.png $(ARGS)

.PHONY: release
release: dashboard ## the service, optimised, with its page
	cargo build --release --locked --package cogmap --bin cogmap

.PHONY: release-lab
release-lab: dashboard ## the service and its laboratory, optimised
	cargo build --release --locked --package cogmap --package cogmap-lab --bins

# Beside the gate: the binary in the wheel is an optimised one, which takes minutes.
.PHONY: wheels
wheels: dashboard $(VENV)/installed ## wheels of the Python client and of the service, in target/wheels
	rm -rf $(TARGET)/wheels
	$(VENV)/bin/pip install --quiet --disable-pip-version-check 'maturin>=1.9,<2'
	$(VENV)/bin/pip wheel --quiet --disable-pip-version-check --no-deps \
	    --wheel-dir $(TARGET)/wheels ./$(CLIENT)
	cd service/wheel && $(VENV)/bin/maturin build --release --out $(TARGET)/wheels

.PHONY: wheels-check
wheels-check: wheels ## installs the wheels on a machine without Rust, runs the demo and a robot
	COGMAP_WHEELS=$(TARGET)/wheels $(VENV)/bin/pytest tests/wheels

# Beside the gate: it needs an engine, and builds Zenoh in the image. BASES=local makes the images
# that it begins with where no registry can be reached.
ENGINE ?= docker
.PHONY: docker-check
docker-check: $(VENV)/installed ## builds and tries the image; ENGINE=podman, BASES=local
ifeq ($(BASES),local)
	ENGINE='$(ENGINE)' docker/bases.sh $$(sed -nE 's/^FROM ([^ ]+).*/\1/p' docker/Dockerfile)
endif
	BUILDAH_FORMAT=docker $(ENGINE) build --file docker/Dockerfile --tag cogmap $(BUILD_ARGS) .
	ENGINE='$(ENGINE)' IMAGE=cogmap $(VENV)/bin/pytest tests/image

# Beside the gate, which tries the same store in a directory: the S3 server is a large package.
.PHONY: object-storage-check
object-storage-check: $(VENV)/installed ## services over a real S3 server: kills, take-overs, a storage that stands still
	cargo build $(ALL)
	$(VENV)/bin/pip install --quiet --disable-pip-version-check \
	    --requirement tests/object_storage/requirements.txt
	$(VENV)/bin/pytest tests/object_storage

# Beside the gate, for it takes most of an hour. The optimised service, for times are asserted.
ROUNDS ?= 20
CLUSTER := tests/cluster
.PHONY: drills-cluster
drills-cluster: release-cluster ## several nodes over one S3 server: kills, cuts, a storage that fails; ROUNDS=3 ARGS="-k frozen" FIGURES=FILE
	COGMAP_BIN=$(TARGET)/release/cogmap COGMAP_DRILL_ROUNDS=$(ROUNDS) \
	    COGMAP_DRILL_FIGURES='$(FIGURES)' $(VENV)/bin/pytest -s $(CLUSTER) $(ARGS)

.PHONY: measure-cluster
measure-cluster: release-cluster ## several nodes beside an embedded store, as JSON; ARGS="--nodes 1 3 --spaces 64 --seconds 20"
	COGMAP_BIN=$(TARGET)/release/cogmap $(VENV)/bin/python $(CLUSTER)/measure.py $(ARGS)

.PHONY: release-cluster
release-cluster: $(VENV)/installed
	cargo build --release --locked --package cogmap --bin cogmap --features object-storage
	$(VENV)/bin/pip install --quiet --disable-pip-version-check \
	    --requirement $(CLUSTER)/requirements.txt

.PHONY: docs
docs: ## documentation of the crates, in target/doc
	cargo doc --locked --workspace --no-deps --lib --examples

.PHONY: fmt
fmt: ## format the Rust code
	cargo fmt --all

.PHONY: clean
clean: ## remove what was built
	cargo clean
	rm -rf $(VENV) $(PEERS)/.venv $(BROWSER)/.venv $(DASHBOARD)/node_modules \
	    $(PEERS)/.mypy_cache $(CLIENT)/.mypy_cache $(CLIENT)/.pytest_cache
