// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/hash.h"

#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

// Test vector of FIPS 180-2, appendix B.1.
TEST(Sha256, OfAbcIsThePublishedOne) {
  TemporaryFolder folder;
  write_text(folder / "abc", "abc");
  EXPECT_EQ(sha256(folder / "abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Sha256, OfAnEmptyFileIsThePublishedOne) {
  TemporaryFolder folder;
  write_text(folder / "empty", "");
  EXPECT_EQ(sha256(folder / "empty"), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Sha256, OfAFolderFollowsItsFilesAndTheirNames) {
  TemporaryFolder folder;
  write_text(folder / "series/a", "1");
  write_text(folder / "series/b", "2");
  const std::string before = sha256(folder / "series");
  std::filesystem::rename(folder / "series", folder / "moved");
  EXPECT_EQ(sha256(folder / "moved"), before);
  write_text(folder / "moved/b", "3");
  EXPECT_NE(sha256(folder / "moved"), before);
}

TEST(Sha256, AMissingFileIsNamed) {
  expect_words(input_error([] { sha256("/no/such/file"); }), {"/no/such/file"});
}

}  // namespace
}  // namespace supine::pipeline
