// SPDX-License-Identifier: AGPL-3.0-or-later
// Makes the run of the small case that the tests of the built tools share: make_small_run FOLDER
#include <cstdio>
#include <exception>
#include <filesystem>

#include "tests/pipeline/small_run.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    std::filesystem::remove_all(argv[1]);
    supine::pipeline::make_small_run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
