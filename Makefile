# SPDX-License-Identifier: AGPL-3.0-or-later
#
#   make demo                        install what is missing, build, take the sample from its MRI to the report
#   make test [LONG=ON] [DATA=dir]   the same set-up, then the tests, with LONG=ON also those that tests/long.txt names; DATA: docs/data.md
#   make CASE=dir [OUT=dir] [stage]  run a case: segment reconstruct decimate mesh simulate compare, or as far as its data allow;
#                                    then calibrate, diagnose, ladder, sensitivity, targets, warp; report: one page of what is there
#   make COHORT=dir [TARGET=stage] [OUT=dir] [PROFILE=cohort/slurm]
#                                    the same for every case in the folder; with PROFILE through Snakemake: cohort/README.md
#   make fuzz [FUZZ_SECONDS=60] [FUZZ_INPUTS=0] [FUZZ_TARGETS="ply vtu"] [FUZZ_SEED=0]
#                                    every reader of files under libFuzzer, for that long or with that many inputs each: tests/fuzz/README.md
#   make sanitize [SANITIZE="test_meshing test_fuzz"] [SHORT=ON]
#                                    every test, these, or those that are short, under address and undefined-behaviour sanitizers:
#                                    tests/sanitizers/README.md
#   make sanitize-threads            tests of what runs in parallel under the thread sanitizer
#   make style                       whether every source file is as clang-format 14 writes it; make format writes it
#   make build                       only build, into $(BUILD); make tools: without tests and measurements
#   make package                     Debian packages in $(BUILD)/package; make package-test installs and tries them in a bare Debian 12
#   make bench [DATA=dir]            every measurement of docs/verification.md and docs/performance.md: hours, on a quiet machine
#   make study [DATA=dir]            every table of docs/study.md: an hour or more, on a quiet machine
#   make hidden [N=60] [SEED=1]      N cases with a sealed answer, each diagnosed from its folder alone; confusion matrix
#        [REALISTIC=1] [PRIOR=1] [SET=pairs|foreign|doses|large] [QUARTER=1..4] [SEED_FROM=tag] [ROWS=file]: docs/hidden.md

SHELL := /bin/bash
BUILD ?= build
CONFIG ?= Release
# ON: warnings are errors, library assertions are on; what .ci/run builds.
DEVELOPER ?= OFF
# One compiler per core, as far as 1.5 GB of free memory for each allow: heavy templates.
JOBS ?= $(shell awk -v cores=$$(nproc) '/^MemAvailable/ { m = int($$2 / 1572864); n = m < cores ? m : cores; print n < 1 ? 1 : n }' /proc/meminfo)

stages := segment reconstruct decimate mesh simulate register compare calibrate diagnose ladder sensitivity draws targets warp report summary
run_case = +@$(MAKE) --no-print-directory -f pipeline/Makefile BIN=$(BUILD)/bin

# Data that the repository does not hold: docs/data.md.
DATA ?= data

.PHONY: style format bench study hidden demo test sanitize sanitize-threads fuzz build tools package package-test configure setup clang clean help case cohort $(stages)

ifdef CASE
case: tools
	$(run_case)
$(stages): tools
	$(run_case) $@
else ifdef COHORT
cohort: tools
ifdef PROFILE
	@command -v snakemake >/dev/null || { echo "PROFILE=$(PROFILE) needs Snakemake: apt-get install snakemake" >&2; exit 2; }
	@snakemake -s cohort/Snakefile --profile $(PROFILE) --config cohort=$(COHORT) $(if $(TARGET),target=$(TARGET)) $(if $(OUT),out=$(OUT)) bin=$(BUILD)/bin \
	  $(if $(MAKE_CASE),make="$(MAKE_CASE)")
else
	+@$(MAKE) --no-print-directory -f cohort/Makefile BIN=$(BUILD)/bin
endif
else
help:
	@sed -n '3,/^$$/s/^#//p' Makefile
$(stages):
	@echo "Which case? make CASE=dir $@" >&2; exit 2
endif

setup:
	@pipeline/setup.sh

configure: setup
	@[ -f $(BUILD)/build.ninja ] || cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=$(CONFIG) -DSUPINE_DEVELOPER=$(DEVELOPER) -DSUPINE_SHARED_DATA=$(abspath $(DATA))

build: configure
	@cmake --build $(BUILD) --parallel $(JOBS)

# A case needs no tests and measurements: half of the work.
tools: configure
	@cmake --build $(BUILD) --parallel $(JOBS) --target tools

demo: tools
	$(run_case) CASE=samples/ligament
	@echo
	@echo "The RMS is well above the scanner's noise on purpose. Calibrating, and asking what the model lacks: a minute or so."
	$(run_case) CASE=samples/ligament diagnose report
	@echo
	@echo "Open samples/ligament/out/report.html in a browser. To see the error fall on the body as what is missing is added:"
	@echo "  make CASE=samples/ligament ladder report"

package: tools
	@cmake --build $(BUILD) --parallel $(JOBS) --target man_pages python_module
	@cd $(BUILD) && cpack -G DEB --config CPackConfig.cmake -B package
	@rm -rf $(BUILD)/package/_CPack_Packages && ls -lh $(BUILD)/package/*.deb

# Needs root, debootstrap and Debian's registry: not part of make test.
package-test: package
	@tests/package/package_test.sh $(BUILD)/package $(BUILD)/package-test

# Long tests, named in tests/long.txt: OFF leaves them out, ON runs them too, ONLY nothing else.
LONG ?= OFF
long_tests = "^($$(paste -sd'|' tests/long.txt))$$"
test: build
	@$(if $(filter OFF,$(LONG)),echo "$$(wc -l < tests/long.txt) long tests are left out; make test LONG=ON runs them too")
	@ctest --test-dir $(BUILD) --output-on-failure --parallel 2 $(if $(filter OFF,$(LONG)),-E $(long_tests)) $(if $(filter ONLY,$(LONG)),-R $(long_tests))

# Clang's own build folders.
clang: setup
	@echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' | \
	  clang++ -fsanitize=fuzzer,address -fopenmp -x c++ - -o /dev/null 2>/dev/null || \
	  { echo "sanitizers and fuzzing need clang, its runtime and its OpenMP: apt-get install clang libclang-rt-14-dev libomp-dev" >&2; exit 2; }

build-sanitize/build.ninja build-sanitize-threads/build.ninja: | clang
	@cmake --preset $(patsubst build-%/,%,$(dir $@)) -DSUPINE_SHARED_DATA=$(abspath $(DATA))

# Executables; none: every test there is.
sanitized = $(or $(SANITIZE),$(if $(filter sanitize-threads,$@),$(sanitize_threads),$(if $(SHORT),$(sanitize_short))))
sanitize_short := test_common test_reconstruction test_segmentation
sanitize_threads := test_common test_reconstruction test_registration test_simulation test_segmentation test_meshing test_fitting test_warp test_diagnosis
sanitize sanitize-threads: %: build-%/build.ninja
	@source tests/sanitizers/options.sh && cmake --build build-$@ --parallel $(JOBS) --target $(or $(sanitized),tests/all tools)
	@tests/sanitizers/run.sh build-$@ $(if $(SHORT),--short) $(sanitized)

# Only the fuzzer is built.
FUZZ_INPUTS ?= 0
FUZZ_SECONDS ?= $(if $(filter 0,$(FUZZ_INPUTS)),60,0)
FUZZ_SEED ?= 0
fuzz: build-sanitize/build.ninja
	@cmake --build build-sanitize --parallel $(JOBS) --target fuzz_readers write_seeds
	@tests/fuzz/run.sh build-sanitize $(FUZZ_SECONDS) $(FUZZ_INPUTS) $(FUZZ_SEED) $(FUZZ_TARGETS)

# Version 14, Debian 12's: other versions write other lines.
clang_format = $(firstword $(shell command -v clang-format-14 clang-format))
sources = $(shell git ls-files '*.cpp' '*.h')
style format:
	@$(or $(clang_format),clang-format) --version | grep -q 'version 14\.' || { echo "make $@ needs clang-format 14: apt-get install clang-format-14" >&2; exit 2; }
	@$(clang_format) $(if $(filter style,$@),--dry-run -Werror,-i) $(sources)

study: build
	@[ -d $(DATA)/hidden-open ] || { echo "$(DATA)/hidden-open is not there; name the folder: make study DATA=dir (docs/data.md)" >&2; exit 2; }
	@bench/study.sh $(DATA)/hidden-open $(BUILD)/study $(BUILD)/bin

bench: build
	@bench/run_all.sh $(DATA) $(BUILD)/bench $(BUILD)/bin

# Goes on where an earlier call stopped; docs/hidden.md.
hidden_seed := $(if $(SEED_FROM),--seed-from $(SEED_FROM),$(if $(SEED),--seed $(SEED)))
hidden_work := $(BUILD)/hidden$(if $(PRIOR),-prior)$(if $(SET),-$(SET))$(if $(REALISTIC),-realistic)-$(or $(SEED_FROM),$(SEED),1)
hidden: build
	@bench/hidden.py $(hidden_work) --bin $(BUILD)/bin $(hidden_seed) $(if $(N),--cases $(N)) $(if $(PRIOR),--prior) \
	  $(if $(REALISTIC),--realistic) $(if $(SET),--set $(SET)) $(if $(QUARTER),--quarter $(QUARTER)) $(if $(ROWS),--rows $(ROWS)) $(HIDDEN)

clean:
	rm -rf $(BUILD)
