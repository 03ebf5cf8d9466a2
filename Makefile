# SPDX-License-Identifier: AGPL-3.0-or-later
#
#   make demo                        install what is missing, build, run the sample case, print what came out
#   make test                        the same set-up, then every test
#   make CASE=dir [OUT=dir] [stage]  run a case: segment reconstruct decimate mesh simulate compare, or as far as its data allow
#   make build                       only build, into $(BUILD)

SHELL := /bin/bash
BUILD ?= build
CONFIG ?= Release
# One compiler per core, as far as 1.5 GB of free memory for each allow: heavy templates.
JOBS ?= $(shell awk -v cores=$$(nproc) '/^MemAvailable/ { m = int($$2 / 1572864); n = m < cores ? m : cores; print n < 1 ? 1 : n }' /proc/meminfo)

stages := segment reconstruct decimate mesh simulate compare summary
run_case = +@$(MAKE) --no-print-directory -f pipeline/Makefile BIN=$(BUILD)/bin

.PHONY: demo test build setup clean help case $(stages)

ifdef CASE
case: build
	$(run_case)
$(stages): build
	$(run_case) $@
else
help:
	@sed -n '3,7s/^#//p' Makefile
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

clean:
	rm -rf $(BUILD)
