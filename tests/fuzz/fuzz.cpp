// SPDX-License-Identifier: AGPL-3.0-or-later
// The readers under libFuzzer: fuzz_readers --target=NAME [options of libFuzzer] CORPUS. See README.md.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "tests/fuzz/targets.h"

namespace {

const supine::fuzz::Target* chosen = nullptr;

// A trial process (common/trial_process.h) that dies is no finding: it must not write libFuzzer's report of one.
void forget_the_fuzzer() {
  __sanitizer_set_death_callback([] {});
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const std::string option = "--target=";
  for (int i = 1; i < *argc; ++i)
    if (const std::string word = (*argv)[i]; word.rfind(option, 0) == 0) {
      try {
        chosen = &supine::fuzz::target_of(word.substr(option.size()));
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        std::exit(2);
      }
    }
  if (chosen == nullptr) {
    std::fprintf(stderr, "name a reader: --target=NAME\n");
    std::exit(2);
  }
  pthread_atfork(nullptr, nullptr, forget_the_fuzzer);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  supine::fuzz::read_input(*chosen, {reinterpret_cast<const char*>(data), size});
  return 0;
}
