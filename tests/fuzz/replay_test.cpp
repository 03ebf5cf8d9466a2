// SPDX-License-Identifier: AGPL-3.0-or-later
// Inputs that once brought a reader down, or made it throw what is no InputError.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "tests/fuzz/targets.h"

namespace supine::fuzz {
namespace {

namespace fs = std::filesystem;

const fs::path regressions = fs::path(SUPINE_SOURCE_DIR) / "tests/fuzz/regressions";

class Replay : public ::testing::TestWithParam<std::string> {};

TEST_P(Replay, EveryInputIsReadOrRefused) {
  const Target& target = target_of(GetParam());
  for (const auto& entry : fs::directory_iterator(regressions / target.name)) {
    std::ifstream stream(entry.path(), std::ios::binary);
    const std::string input((std::istreambuf_iterator<char>(stream)), {});
    EXPECT_NO_THROW(read_input(target, input)) << entry.path();
  }
}

std::vector<std::string> readers_with_regressions() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(regressions)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Readers, Replay, ::testing::ValuesIn(readers_with_regressions()),
                         [](const auto& reader) { return reader.param; });

TEST(Targets, HaveNamesOfTheirOwnAndFiles) {
  std::vector<std::string> names;
  for (const Target& target : targets()) {
    names.push_back(target.name);
    EXPECT_FALSE(target.files.empty()) << target.name;
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

TEST(Targets, AReaderThatThrowsAnythingElseIsNoticed) {
  const Target broken = {"broken", {"a"}, [](const fs::path&) { throw std::bad_alloc(); }};
  EXPECT_THROW(read_input(broken, "x"), std::bad_alloc);
}

TEST(Targets, PartsOfAnInputBecomeFiles) {
  std::vector<std::uintmax_t> sizes;
  const Target two = {"two", {"a", "b/c"}, [&sizes](const fs::path& folder) {
                        sizes = {fs::file_size(folder / "a"), fs::file_size(folder / "b/c")};
                      }};
  read_input(two, joined({"one", "and two"}));
  EXPECT_EQ(sizes, (std::vector<std::uintmax_t>{3, 7}));
}

}  // namespace
}  // namespace supine::fuzz
