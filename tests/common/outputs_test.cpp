// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/outputs.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "common/error.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

class OutputsTest : public ::testing::Test {
 protected:
  OutputsTest() { fs::create_directories(folder); }
  ~OutputsTest() override { fs::remove_all(folder); }
  static std::string text(const fs::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  std::size_t files() const { return std::distance(fs::directory_iterator(folder), fs::directory_iterator()); }
  const fs::path folder = fs::temp_directory_path() / ("outputs_test_" + std::to_string(getpid()));
};

TEST_F(OutputsTest, FilesAppearTogetherOnCommit) {
  Outputs outputs(false);
  std::ofstream(outputs.stage(folder / "a.txt")) << "A";
  std::ofstream(outputs.stage(folder / "deep" / "b.txt")) << "B";
  EXPECT_FALSE(fs::exists(folder / "a.txt"));
  outputs.commit();
  EXPECT_EQ(text(folder / "a.txt"), "A");
  EXPECT_EQ(text(folder / "deep" / "b.txt"), "B");
}

TEST_F(OutputsTest, WhatAKilledProcessLeftIsRemovedAndWhatALivingOneWritesIsNot) {
  const fs::path dead = folder / ".a.part999999999.txt", living = folder / ".a.part1.txt",
                 other = folder / ".b.part999999999.txt";
  for (const fs::path& file : {dead, living, other}) std::ofstream(file) << "half";
  Outputs(false).stage(folder / "a.txt");
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_TRUE(fs::exists(living));
  EXPECT_TRUE(fs::exists(other));
}

TEST_F(OutputsTest, WithoutCommitNothingIsLeft) {
  {
    Outputs outputs(false);
    std::ofstream(outputs.stage(folder / "new" / "deep" / "a.txt")) << "A";
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(OutputsTest, ExistingFilesNeedForce) {
  std::ofstream(folder / "a.txt") << "old";
  Outputs careful(false);
  EXPECT_THROW(careful.stage(folder / "a.txt"), InputError);
  Outputs forced(true);
  std::ofstream(forced.stage(folder / "a.txt")) << "new";
  EXPECT_EQ(text(folder / "a.txt"), "old");
  forced.commit();
  EXPECT_EQ(text(folder / "a.txt"), "new");
}

TEST_F(OutputsTest, WhatIsNoFileIsNeverReplaced) {
  const fs::path pipe = folder / "pipe.txt", inner = folder / "inner.txt";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directories(inner);
  for (const bool force : {false, true})
    for (const fs::path& target : {pipe, inner}) {
      Outputs outputs(force);
      EXPECT_THROW(outputs.stage(target), InputError) << target;
      outputs.commit();
    }
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_TRUE(fs::is_directory(inner));
  EXPECT_EQ(files(), 2u);
}

TEST_F(OutputsTest, AFolderThatCannotBeMadeIsRefused) {
  std::ofstream(folder / "file") << "in the way";
  Outputs outputs(true);
  EXPECT_THROW(outputs.stage(folder / "file" / "a.txt"), InputError);
}

TEST_F(OutputsTest, InterruptRemovesStagedFilesAndEndsWith130) {
  const pid_t child = fork();
  if (child == 0) {
    install_interrupt_handler();
    Outputs outputs(false);
    std::ofstream(outputs.stage(folder / "a.txt")) << "A";
    raise(SIGINT);
    _exit(1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_EQ(files(), 0u);
}

}  // namespace
}  // namespace supine
