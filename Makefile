# The front door: on a fresh Debian 12 with git and make, `make demo` and `make test` each work from nothing.
BUILD ?= build/release
PREFIX ?= /usr/local
DEMO ?= demo
DATA ?= ../shared/data
JOBS ?= $(shell nproc)
FUZZ_SECONDS ?= 600
CMAKE_ARGS ?=
SEED ?= 10001
SCENES ?= 1000
ROUND ?= 0.3
MESHES ?= 0.3
RUNS ?= 20
KIND ?= lift

PYTHON ?= /usr/bin/python3
PYTHON_DEVICE ?= cpu
REFERENCE ?= tests/reference
RELEASE ?=
ENGINE ?= $(notdir $(firstword $(shell command -v docker podman buildah)))
CONTAINER_ARGS ?=
RUN_IMAGE ?= $(ENGINE) run --rm flash:$(VERSION)
VERSION = $(word 3,$(shell grep '^project.flash ' CMakeLists.txt))

sysid = $(BUILD)/bin/flash-sysid
sources = git ls-files '*.h' '*.cpp' '*.cu' '*.cuh'

.DEFAULT_GOAL := demo
.PHONY: help demo configure build test validate routes coverage agreement other-simulators plan-promise answer-time size-study lens-study link-length-study use-study watch-study held-out arm-errors pairs-coverage
.PHONY: cells grasp-convergence grasp-shapes few-views-study knock-study motion-study moving-arm-study ridge-study same-answers locking drape clamped-strip self-contact contact-counts contact-methods contact-metrics scene-batch silicone reference fuzz sanitize
.PHONY: sanitize-threads python-test python-rate configure-test format check-format check-includes tidy
.PHONY: tours examples constants container container-test pictures site release studies kinhec device-checks device-answers install clean bench random-scenes deep-starts packages-build packages-test packages-bench packages-check packages-site

help:  ## This list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 24

demo: configure  ## Packages, build, then the main job on the recording in examples/towel_lift: $(DEMO)/tuned.json, $(DEMO)/run/report.html
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(sysid) segment examples/towel_lift/camera1 --trajectory examples/towel_lift/gripper.tum --times rate:10 --force -o $(DEMO)/segmented
	$(sysid) import $(DEMO)/segmented/frames --mesh sheet:0.3x0.3:0.02 --grasp corner:1,1 --tool-at patch --heading -135 \
	  --crop-z 0.008: --offset-bound 0.02 --force -o $(DEMO)/lift
	$(sysid) grid $(DEMO)/lift --asset examples/assets/towel.json --bending 5e-5:1e-3:9:log --friction 0.2:0.4:3 \
	  --hold areal_density=0.2:measured --force -o $(DEMO)/run
	$(sysid) export $(DEMO)/run --force -o $(DEMO)/tuned.json
	@printf '\n%s\n' 'Tuned asset: $(abspath $(DEMO)/tuned.json)' \
	  'Report:      $(abspath $(DEMO)/run/report.html)   (open it in a browser)' \
	  'Truth:       $(abspath examples/towel_lift/truth.json)'

tours: build  ## Packages, build, then the commands of Start and of both tours, in order, with the seconds of each and their sum
	$(PYTHON) tests/documents/tours.py start.md calibrate_a_cell.md identify_a_towel.md --bin $(BUILD)/bin --out $(BUILD)/tours

examples: configure-test  ## Draw the recordings in examples/ anew, by the commands of their README
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid flash-calib rendered_dataset
	$(PYTHON) tests/documents/examples_test.py --bin $(BUILD)/bin --draw $(BUILD)/tests/rendered_dataset --write

constants:  ## Put the table of the estimator's constants into docs/experiments.md, by the comments of the sources
	$(PYTHON) tests/documents/constants.py --write

# The image has the version as its tag. ENGINE is docker, podman or buildah; CONTAINER_ARGS='--build-arg CUDA=ON' is for NVIDIA devices.
container:  ## An image of programs, Python package and examples, by docker, podman or buildah: flash:VERSION
	@test -n "$(ENGINE)" || { echo 'make container: found neither docker, podman nor buildah' >&2; exit 2; }
	$(ENGINE) build $(CONTAINER_ARGS) --tag flash:$(VERSION) --file Containerfile .

container-test:  ## Say whether the image of make container runs, by docker or podman; RUN_IMAGE says another way to run a command in it
	$(PYTHON) tests/scripts/image_test.py --run "$(RUN_IMAGE)"

build: configure  ## Packages, then the release build in $(BUILD)
	cmake --build $(BUILD) -j $(JOBS)

configure: packages-build
	cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release -DFLASH_TESTS=OFF $(CMAKE_ARGS)

test: configure-test  ## Packages, build, then all tests
	cmake --build $(BUILD) -j $(JOBS)
	ctest --test-dir $(BUILD) -j $(JOBS) --output-on-failure --no-tests=error

bench: packages-build packages-test packages-bench  ## Packages, build, then the benchmarks of the solver
	cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release -DFLASH_TESTS=ON -DFLASH_BENCHMARKS=ON $(CMAKE_ARGS)
	cmake --build $(BUILD) -j $(JOBS) --target flash_bench flash-sim
	$(BUILD)/tests/flash_bench
	$(BUILD)/bin/flash-sim bench --vertices 1000 --envs 64 --steps 250 --threads 2

configure-test: packages-build packages-test
	cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release -DFLASH_TESTS=ON $(CMAKE_ARGS)

validate: reference configure-test  ## Calibrate and fit what is in $(DATA), renew docs/validation/; ONLY=handeye, lift_navy, ...
	cmake --build $(BUILD) -j $(JOBS) --target hand_eye_study
	$(PYTHON) tests/validation/validate.py --sysid $(sysid) --calib $(BUILD)/bin/flash-calib --sim $(BUILD)/bin/flash-sim \
	  --hand-eye-study $(BUILD)/tests/hand_eye_study --data $(DATA) --scenes $(REFERENCE)/scenes \
	  --results $(BUILD)/reference --out $(BUILD)/validation --documents docs/validation $(if $(ONLY),--only $(ONLY)) $(if $(TWINS),--twins $(TWINS))

routes: configure-test  ## Say whether every route to an answer gives the same one, on a strip of known truth
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/routes.py --sysid $(sysid) --out $(BUILD)/routes

coverage: configure-test  ## Say whether intervals hold the truth of RUNS twins from SEED on, of KIND corner_lift, lift, drape or bar_pull; ROWS=coverage.json of earlier calls; ALSO=sampled answers each again by importance sampling, ALSO=grids on grids
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/coverage.py --sysid $(sysid) --out $(BUILD)/coverage_$(KIND) --kind $(KIND) --seed $(SEED) --runs $(RUNS) $(if $(ROWS),--rows $(ROWS)) $(if $(ALSO),--also $(ALSO))

agreement: configure-test  ## Say whether searches of two recordings tell one cloth from two, RUNS materials from SEED on
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/agreement.py --sysid $(sysid) --out $(BUILD)/agreement --seed $(SEED) --runs $(RUNS)

grasp-convergence: configure-test  ## Say how far cells move D of a corner lift, of motions and of searches, and how far the stated size of the patch does
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/grasp_convergence.py --sysid $(sysid) --out $(BUILD)/grasp_convergence --documents docs/validation $(if $(ONLY),--only $(ONLY))

cells: configure-test  ## Say whether segment and import take rendered cells whose inputs belong together, and refuse those with a wrong one
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/cells.py --sysid $(sysid) --out $(BUILD)/cells --documents docs/validation

grasp-shapes: configure-test  ## Say whether compare tells how strips were grasped, RUNS of them from SEED on
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/grasp_shapes.py --sysid $(sysid) --out $(BUILD)/grasp_shapes --seed $(SEED) --runs $(RUNS)

other-simulators: configure-test  ## Search the lifts that other simulators made, from $(DATA)/twin, and say what holds
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/other_simulators.py --sysid $(sysid) --data $(DATA)/twin --out $(BUILD)/other_simulators

plan-promise: configure-test  ## Say whether following the first proposal of plan narrows what it promised, on ten strips of known truth
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/plan_promise.py --sysid $(sysid) --out $(BUILD)/plan_promise

answer-time: configure-test  ## Say how long it takes from kept motions to the answer: at most 10 s on two idle cores
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/answer_time.py --sysid $(sysid) --out $(BUILD)/answer_time

held-out: configure-test  ## Say whether hand-eye answers predict views left out better than four other methods, on what $(DATA) has and on 40 drawn cells
	cmake --build $(BUILD) -j $(JOBS) --target flash-calib drawn_cells
	$(PYTHON) tests/validation/handeye_methods.py --program $(BUILD)/bin/flash-calib $(DATA)/handeye
	$(BUILD)/tests/drawn_cells $(BUILD)/held_out 40 8100001 1
	$(PYTHON) tests/validation/handeye_methods.py --drawn $(BUILD)/held_out

size-study: configure-test  ## Say whether hand-eye calibration states its uncertainty truly, over 200 fresh scenes of each kind
	cmake --build $(BUILD) -j $(JOBS) --target size_study
	$(BUILD)/tests/size_study

lens-study: configure-test  ## Say whether hand-eye calibration states truly how well it knows its lens, and what another recording differs by, over 60 fresh rigs of each kind
	cmake --build $(BUILD) -j $(JOBS) --target lens_study
	$(BUILD)/tests/lens_study

link-length-study: configure-test  ## Say whether lengths of an arm's links are found beside the zeros of its joints, over 30 fresh recordings of each kind
	cmake --build $(BUILD) -j $(JOBS) --target link_length_study
	$(BUILD)/tests/link_length_study

use-study: configure-test  ## Say what each use of a hand-eye calibration (--for) gains, over 100 fresh scenes of each kind
	cmake --build $(BUILD) -j $(JOBS) --target use_study
	$(BUILD)/tests/use_study

few-views-study: configure-test  ## Say whether hand-eye calibration states its uncertainty truly from 4, 5, 6 and 8 views, over 200 fresh scenes of each kind
	cmake --build $(BUILD) -j $(JOBS) --target few_views_study
	$(BUILD)/tests/few_views_study

knock-study: configure-test  ## Say whether hand-eye calibration sees knocks near either end of a recording, and none where nothing moved
	cmake --build $(BUILD) -j $(JOBS) --target knock_study
	$(BUILD)/tests/knock_study

motion-study: configure-test  ## Say which motions hand-eye calibration claims and finds in subsets of real and drawn recordings, beside what could be found
	cmake --build $(BUILD) -j $(JOBS) --target motion_study
	$(BUILD)/tests/motion_study 5 5000001 $(DATA)/handeye $(BUILD)/corners

moving-arm-study: configure-test  ## Say whether hand-eye calibration finds the camera's clock and pose while the arm moves, from blurred pictures that are 30 ms late
	cmake --build $(BUILD) -j $(JOBS) --target moving_arm_study
	$(BUILD)/tests/moving_arm_study

watch-study: configure-test  ## Say how many views following the next pose of flash-calib watch takes, beside views at random, over ten simulated cells of each kind
	cmake --build $(BUILD) -j $(JOBS) --target watch_study
	$(BUILD)/tests/watch_study

pairs-coverage: configure-test  ## Say how often stated regions of pairs of poses hold the truth: drawn arms, RUNS of each kind from SEED on
	cmake --build $(BUILD) -j $(JOBS) --target flash-calib
	$(PYTHON) tests/validation/pairs_coverage.py --calib $(BUILD)/bin/flash-calib --runs $(RUNS) --seed $(SEED)

arm-errors:  ## Say over which reach and of which size errors of drawn arms are, as hand-eye calibration expects them
	$(PYTHON) tests/validation/arm_errors.py

kinhec: configure-test  ## Say how pairs of the public benchmark KinHEC (pip install kinhec) are answered beside its own methods
	cmake --build $(BUILD) -j $(JOBS) --target flash-calib
	$(PYTHON) tests/validation/kinhec.py --calib $(BUILD)/bin/flash-calib --size-known --out $(BUILD)/kinhec

same-answers: configure  ## Say that orders, ranges, units and where a scene stands change no answer
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/robustness/same_answers.py --sysid $(BUILD)/bin/flash-sysid

ridge-study: configure-test  ## Say whether posteriors on ridges, straight and bent, of 2 to 6 parameters are right, over 200 draws each
	cmake --build $(BUILD) -j $(JOBS) --target ridge_study
	$(BUILD)/tests/ridge_study

studies: configure-test  ## Build all studies
	cmake --build $(BUILD) -j $(JOBS) --target studies

random-scenes: configure-test  ## Simulate SCENES random scenes from SEED on, of solids with SOLIDS=1, that meet themselves at up to LAYERS=1 m/s, of fast bodies with FAST=1; say what was not solved, and what energy, gaps and ways say
	cmake --build $(BUILD) -j $(JOBS) --target random_scene_study
	$(BUILD)/tests/random_scene_study $(SEED) $(SCENES) --round $(ROUND) --mesh $(MESHES) $(if $(SOLIDS),--solid) $(if $(LAYERS),--layers $(LAYERS)) $(if $(FAST),--fast) --list

deep-starts: configure-test  ## Simulate SCENES random sheets that start across obstacles; say how fast they come out
	cmake --build $(BUILD) -j $(JOBS) --target random_scene_study
	$(BUILD)/tests/random_scene_study $(SEED) $(SCENES) --deep --round $(ROUND) --mesh $(MESHES) --list

self-contact: configure-test  ## Say what sheets do that meet themselves and each other, on six scenes
	cmake --build $(BUILD) -j $(JOBS) --target self_contact_study
	$(BUILD)/tests/self_contact_study

contact-methods: configure-test  ## Put multipliers and an augmented Lagrangian between layers beside the barrier, on eight scenes
	cmake --build $(BUILD) -j $(JOBS) --target contact_methods_study
	$(BUILD)/tests/contact_methods_study

contact-metrics: build packages-test  ## Say how far a sheet sinks and creeps under the published method's inexact metric, beside the full and the exact one
	$(PYTHON) tests/validation/contact_metrics.py --sim $(BUILD)/bin/flash-sim --out $(BUILD)/contact_metrics

contact-counts: configure-test  ## Say how many iterations a step takes as contacts grow, up to some 100,000 in one environment
	cmake --build $(BUILD) -j $(JOBS) --target self_contact_study
	$(BUILD)/tests/self_contact_study contacts

scene-batch: configure-test  ## Say how long steps of the T-shirt take in 1, 64 and 256 environments, on two threads
	cmake --build $(BUILD) -j $(JOBS) --target scene_batch_study
	$(BUILD)/tests/scene_batch_study examples/scenes/tshirt_fold.json 2 1 30 64 1 256 1

silicone: build packages-test  ## Say what E silicone parts that sag have by clouds of a lidar, from $(DATA)/silicone
	$(PYTHON) tests/validation/silicone.py --sysid $(sysid) --data $(DATA)/silicone --out $(BUILD)/silicone

locking: configure-test  ## Say how far tetrahedra lock: the tip of a cantilever over Poisson's ratio and mesh
	cmake --build $(BUILD) -j $(JOBS) --target locking_study
	$(BUILD)/tests/locking_study

drape: build packages-test  ## Say how far drapes of a disc are from those of an independent solver, over bending length and mesh
	$(PYTHON) tests/validation/drape.py --sim $(BUILD)/bin/flash-sim --out $(BUILD)/drape

clamped-strip: build packages-test  ## Say how much softer than the beam a clamped strip is, with and without slopes, over its cells
	$(PYTHON) tests/validation/clamped_strip.py --sim $(BUILD)/bin/flash-sim --out $(BUILD)/clamped_strip --documents docs/validation

reference: build packages-test  ## Run the scenes in $(REFERENCE) and judge them by its compare.py
	$(PYTHON) tests/reference/run.py --sim $(BUILD)/bin/flash-sim --scenes $(REFERENCE)/scenes --jobs $(JOBS) \
	  --out $(BUILD)/reference
	$(PYTHON) $(REFERENCE)/compare.py $(BUILD)/reference --all

device-answers: configure-test  ## On a machine with a CUDA device: whether recorded lifts have the same answers by it and by the processor
	cmake --build $(BUILD) -j $(JOBS) --target flash-sysid
	$(PYTHON) tests/validation/device_answers.py --sysid $(sysid) --data $(DATA) --out $(BUILD)/device_answers

device-checks: configure-test  ## On a machine with a CUDA device: its tests, compute-sanitizer on scenes that move, times; PART=tests, sanitizers or times
	cmake --build $(BUILD) -j $(JOBS) --target sim_tests sysid_tests flash-sim
	cmake -G Ninja -S . -B $(BUILD)-racecheck -DCMAKE_BUILD_TYPE=Release -DFLASH_CUDA=ON -DFLASH_RACECHECK=ON
	cmake --build $(BUILD)-racecheck -j $(JOBS) --target sim_tests
	scripts/device-checks $(BUILD) $(PART)

fuzz: packages-build packages-check  ## Fuzz each loader for $(FUZZ_SECONDS) s under address and undefined-behaviour sanitizers
	cmake --preset fuzz
	cmake --build --preset fuzz -j $(JOBS)
	scripts/fuzz build/fuzz $(FUZZ_SECONDS)

sanitize: packages-build packages-test packages-check  ## Tests of data and sim, built by clang, under the address and undefined-behaviour sanitizers
	$(call sanitized,asan-ubsan)

sanitize-threads: packages-build packages-test packages-check  ## Tests of what runs on several threads, under the thread sanitizer
	$(call sanitized,tsan)

# What a preset builds and which tests it runs, CMakePresets.json says.
define sanitized
cmake --preset $1
cmake --build --preset $1 -j $(JOBS)
ctest --preset $1 -j $(JOBS)
endef

python-test: packages-build packages-test  ## Build the wheels of flash_sim and flash_calib in build/python and build/python-calib, install them and run their tests
	scripts/python-test $(PYTHON)

python-rate: python-test  ## Say how fast 128 environments step from Python beside C++, on PYTHON_DEVICE=cpu or cuda
	build/python-venv/bin/python -P tests/validation/python_rate.py --device $(PYTHON_DEVICE)

site: packages-site configure-test  ## The documents as a site that opens offline: build/site/index.html
	cmake --build $(BUILD) -j $(JOBS) --target flash-calib flash-sysid flash-sim
	scripts/site $(PYTHON) $(BUILD)/bin

pictures: packages-site build  ## Draw the pictures of the tours and of reports anew, into docs/images
	$(PYTHON) tests/documents/tours.py start.md calibrate_a_cell.md identify_a_towel.md --bin $(BUILD)/bin --out $(BUILD)/tours --images docs/images

release: packages-site configure-test  ## Sources, wheel, site and container file of the committed state in dist/, then the tag; RELEASE=--no-tag without
	cmake --build $(BUILD) -j $(JOBS) --target flash-calib flash-sysid flash-sim
	scripts/release $(PYTHON) $(BUILD)/bin $(RELEASE)

format: packages-check  ## Lay out all sources as .clang-format says
	$(sources) | xargs -r clang-format -i

check-format: packages-check  ## Name the sources that `make format` would change
	$(sources) | xargs -r clang-format --dry-run --Werror

check-includes:  ## Name the includes that go against the order of the folders
	scripts/check_includes

tidy: configure-test packages-check  ## Defects found by clang-tidy (.clang-tidy)
	scripts/tidy $(BUILD) $(TIDY_SECONDS)

install: build  ## To $(PREFIX), for find_package(flash)
	cmake --install $(BUILD) --prefix $(PREFIX)

clean:  ## Remove build and demo output
	rm -rf build $(DEMO)

packages-build packages-test packages-bench packages-check packages-site: packages-%:
	@scripts/install-packages $*
