// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/trial_process.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "common/error.h"
#include "tests/support/sanitizers.h"

namespace supine {
namespace {

TEST(TrialProcess, LetsThroughWhatComesToItsEnd) {
  int here = 0;
  EXPECT_NO_THROW(check_survivable("a.vtu", [&here] { here = 1; }));
  EXPECT_EQ(here, 0) << "another process did it";
  EXPECT_NO_THROW(check_survivable("a.vtu", [] { throw InputError("for whoever reads again"); }));
}

TEST(TrialProcess, NamesTheFileThatBringsItsReaderDown) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE}) try {
      check_survivable("scan.vtp", [signal] { std::raise(signal); });
      ADD_FAILURE() << signal;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("scan.vtp: damaged"), std::string::npos) << error.what();
    }
}

TEST(TrialProcess, AReaderThatEndsTheProcessIsBroughtDownToo) {
  EXPECT_THROW(check_survivable("scan.vtp", [] { _exit(77); }), InputError);
}

TEST(TrialProcess, WhatIsThrownForNoReaderToCatchBringsItDownToo) {
  EXPECT_THROW(check_survivable("scan.vtp", [] { throw std::runtime_error("no answer"); }), InputError);
  EXPECT_THROW(check_survivable("scan.vtp", [] { throw 3; }), InputError);
  EXPECT_THROW(check_survivable("scan.vtp", [] { std::vector<int>().reserve(std::size_t(-1)); }), InputError);
}

TEST(TrialProcess, RefusesCountsThatNoFileOfItsSizeCanHold) {
  if (under_address_sanitizer) GTEST_SKIP() << "operator new throws nothing here";
  try {
    check_survivable("huge.vtu", [] { std::vector<char> all(std::size_t{1} << 40); });
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("more memory"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace supine
