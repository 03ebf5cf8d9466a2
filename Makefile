# SPDX-License-Identifier: AGPL-3.0-or-later
#
#   make demo                        install what is missing, build, run the sample case, print what came out
#   make test                        the same set-up, then every test
#   make CASE=dir [OUT=dir] [stage]  run a case: segment reconstruct decimate mesh simulate compare, or as far as its data allow;
#                                    then calibrate, diagnose
#   make build                       only build, into $(BUILD)
#   make bench [DATA=dir]            every measurement of docs/verification.md and docs/performance.md: hours, on a quiet machine
#   make study [DATA=dir]            every table of docs/study.md: an hour or more, on a quiet machine

SHELL := /bin/bash
BUILD ?= build
CONFIG ?= Release
# One compiler per core, as far as 1.5 GB of free memory for each allow: heavy templates.
JOBS ?= $(shell awk -v cores=$$(nproc) '/^MemAvailable/ { m = int($$2 / 1572864); n = m < cores ? m : cores; print n < 1 ? 1 : n }' /proc/meminfo)

stages := segment reconstruct decimate mesh simulate compare calibrate diagnose summary
run_case = +@$(MAKE) --no-print-directory -f pipeline/Makefile BIN=$(BUILD)/bin

DATA ?= ../shared/data

.PHONY: bench study demo test build setup clean help case $(stages)

ifdef CASE
case: build
	$(run_case)
$(stages): build
	$(run_case) $@
else
help:
	@sed -n '3,10s/^#//p' Makefile
$(stages):
	@echo "Which case? make CASE=dir $@" >&2; exit 2
endif

setup:
	@pipeline/setup.sh

build: setup
	@[ -f $(BUILD)/build.ninja ] || cmake -G Ninja -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=$(CONFIG)
	@cmake --build $(BUILD) --parallel $(JOBS)

demo: build
	$(run_case) CASE=samples/ligament
	@echo
	@echo "The RMS is well above the scanner's noise on purpose: this patient has a ligament that the model lacks. Give it one:"
	@echo "  cp -r samples/ligament mycase && $(BUILD)/bin/supine-model add ligament mycase/model.toml && make CASE=mycase"

test: build
	@ctest --test-dir $(BUILD) --output-on-failure --parallel 2

study: build
	@bench/study.sh $(DATA)/hidden-open $(BUILD)/study $(BUILD)/bin

bench: build
	@bench/run_all.sh $(DATA) $(BUILD)/bench $(BUILD)/bin

clean:
	rm -rf $(BUILD)
