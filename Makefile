# The front door: on a fresh Debian 12 with git and make, `make demo` and `make test` each work from nothing.
BUILD ?= build/release
PREFIX ?= /usr/local
DEMO ?= demo
JOBS ?= $(shell nproc)
CMAKE_ARGS ?=

sysid = $(BUILD)/bin/flash-sysid
sources = git ls-files '*.h' '*.cpp' '*.cu' '*.cuh'

.DEFAULT_GOAL := demo
.PHONY: help demo build test configure-test format check-format tidy install clean
.PHONY: packages-build packages-test packages-check

help:  ## This list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 24

demo: build  ## Packages, build, then: synthesize a corner lift, search its material, export the tuned asset
	rm -rf $(DEMO)
	$(sysid) synth --asset examples/towel.json --kind corner_lift --seed 1 --truth-out $(DEMO)/truth.json -o $(DEMO)/recording
	$(sysid) grid $(DEMO)/recording --asset examples/towel.json --bending 3e-6:3e-4:7:log --friction 0.1:0.5:3 -o $(DEMO)/run
	$(sysid) export $(DEMO)/run -o $(DEMO)/tuned.json
	@printf '\nTuned asset: %s\nReport:      %s   (open it in a browser)\nTruth:       %s\n' \
	  $(abspath $(DEMO)/tuned.json) $(abspath $(DEMO)/run/report.html) $(abspath $(DEMO)/truth.json)

build: packages-build  ## Packages, then the release build in $(BUILD)
	cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release -DFLASH_TESTS=OFF $(CMAKE_ARGS)
	cmake --build $(BUILD) -j $(JOBS)

test: configure-test  ## Packages, build, then all tests
	cmake --build $(BUILD) -j $(JOBS)
	ctest --test-dir $(BUILD) -j $(JOBS) --output-on-failure --no-tests=error

configure-test: packages-build packages-test
	cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release -DFLASH_TESTS=ON $(CMAKE_ARGS)

format: packages-check  ## Lay out all sources as .clang-format says
	$(sources) | xargs -r clang-format -i

check-format: packages-check  ## Name the sources that `make format` would change
	$(sources) | xargs -r clang-format --dry-run --Werror

tidy: configure-test packages-check  ## Defects found by clang-tidy (.clang-tidy)
	scripts/tidy $(BUILD)

install: build  ## To $(PREFIX), for find_package(flash)
	cmake --install $(BUILD) --prefix $(PREFIX)

clean:  ## Remove build and demo output
	rm -rf build $(DEMO)

packages-build packages-test packages-check: packages-%:
	@scripts/install-packages $*
