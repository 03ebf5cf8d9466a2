// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/tool.h"

#include <csignal>
#include <cstdio>
#include <fstream>

#include "common/error.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;

/// Copies its input and reports a number; fails on demand.
class CopyTool : public Tool {
 public:
  std::string name() const override { return "supine-copy"; }
  std::string summary() const override { return "Copies a file."; }
  void declare(CLI::App& app) override {
    app.add_option("FILE", file, "what to copy")->required();
    app.add_option("--scale", scale, "a factor, > 0")->check(CLI::PositiveNumber);
    app.add_option("--seed", seed, "of the random numbers");
    app.add_option("--fail", fail, "how to fail");
  }
  Outcome run(Run& run) override {
    run.stage("copying");
    std::ofstream(run.output(output)) << read_text(run.input(file));
    run.figures(output)["half_mm"] = 0.5 * scale;
    run.warn("a caution");
    if (fail == "input") throw InputError("bad label 7");
    if (fail == "numbers") throw NumericalFailure("stopped at load 0.5");
    if (fail == "interrupt") raise(SIGINT);
    if (fail == "bug") throw std::logic_error("index");
    return fail == "target" ? Outcome::target_not_met : Outcome::done;
  }
  std::string file, fail;
  double scale = 1;
  int seed = 3;
};

class ToolMain : public testing::Test {
 protected:
  ToolMain() { write_text(folder_ / "in.txt", "abc"); }

  static int call_main(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "supine-copy");
    std::vector<char*> raw;
    for (std::string& argument : arguments) raw.push_back(argument.data());
    CopyTool tool;
    return tool_main(tool, static_cast<int>(raw.size()), raw.data());
  }
  [[noreturn]] static void call_and_exit(const std::vector<std::string>& arguments) { std::exit(call_main(arguments)); }
  /// Runs the tool, catching what it prints.
  int call(const std::vector<std::string>& arguments) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = call_main(arguments);
    out_ = testing::internal::GetCapturedStdout();
    err_ = testing::internal::GetCapturedStderr();
    return code;
  }
  int copy(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {in(), "-o", target()});
    return call(std::move(more));
  }
  std::string in() const { return (folder_ / "in.txt").string(); }
  std::string target() const { return (folder_ / "out/copy.txt").string(); }
  Json sidecar() const { return Json::parse(read_text(folder_ / "out/copy.json")); }
  std::size_t files_written() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path()))
      count += entry.is_regular_file() && entry.path().filename() != "in.txt";
    return count;
  }

  TemporaryFolder folder_;
  std::string out_, err_;
};

TEST_F(ToolMain, WritesTheOutputAndItsSidecar) {
  EXPECT_EQ(copy(), 0);
  EXPECT_EQ(read_text(target()), "abc");
  const Json json = sidecar();
  EXPECT_EQ(json["half_mm"], 0.5);
  EXPECT_EQ(json["warnings"], Json::array({"a caution"}));
  EXPECT_EQ(json["provenance"]["tool"], "supine-copy");
  EXPECT_EQ(json["provenance"]["seed"], 3);
  EXPECT_EQ(json["provenance"]["options"]["scale"], 1);
  EXPECT_EQ(json["provenance"]["inputs"][0]["file"], "in.txt");
  EXPECT_EQ(json["provenance"]["inputs"][0]["sha256"].get<std::string>().substr(0, 8), "ba7816bf");
  EXPECT_TRUE(json["timing"]["stages_s"].contains("copying"));
}

TEST_F(ToolMain, PrintsEveryResolvedOption) {
  copy({"--scale", "2"});
  expect_words(out_, {"supine-copy", "scale = 2", "seed = 3", "threads = "});
}

TEST_F(ToolMain, QuietPrintsWarningsOnly) {
  copy({"--quiet"});
  EXPECT_EQ(out_, "");
  EXPECT_EQ(err_, "supine-copy: warning: a caution\n");
}

TEST_F(ToolMain, JsonPrintsTheSidecarAlone) {
  copy({"--json"});
  EXPECT_EQ(Json::parse(out_), sidecar());
}

TEST_F(ToolMain, TheSidecarIsTheSameElsewhereAndForAnyThreadCountButForTiming) {
  copy({"--threads", "1"});
  Json first = sidecar();
  std::filesystem::create_directories(folder_ / "other");
  std::filesystem::rename(in(), folder_ / "other/in.txt");
  std::filesystem::remove_all(folder_ / "out");
  EXPECT_EQ(call({(folder_ / "other/in.txt").string(), "-o", target(), "--threads", "2", "--quiet"}), 0);
  Json second = sidecar();
  first.erase("timing");
  second.erase("timing");
  EXPECT_EQ(first.dump(), second.dump());
}

TEST_F(ToolMain, TargetNotMetIsWrittenAndEndsWith1) {
  EXPECT_EQ(copy({"--fail", "target"}), 1);
  EXPECT_EQ(read_text(target()), "abc");
}

TEST_F(ToolMain, BadInputEndsWith2AndWritesNothing) {
  EXPECT_EQ(copy({"--fail", "input"}), 2);
  expect_words(err_, {"supine-copy: error: bad label 7"});
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, NumericalFailureEndsWith3AndWritesNothing) {
  EXPECT_EQ(copy({"--fail", "numbers"}), 3);
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, AnUnexpectedErrorEndsWith3AndWritesNothing) {
  EXPECT_EQ(copy({"--fail", "bug"}), 3);
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, CtrlCEndsWith130AndWritesNothing) {
  EXPECT_EXIT(call_and_exit({in(), "-o", target(), "--fail", "interrupt"}), testing::ExitedWithCode(130),
              "interrupted");
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, WrongUseEndsWith2AndNamesTheOption) {
  EXPECT_EQ(call({}), 2);
  expect_words(err_, {"FILE is required", "--help"});
  EXPECT_EQ(copy({"--scael", "2"}), 2);
  expect_words(err_, {"--scael"});
  EXPECT_EQ(copy({"--scale", "two"}), 2);
  expect_words(err_, {"--scale", "two"});
  EXPECT_EQ(copy({"--scale", "-1"}), 2);
  expect_words(err_, {"--scale", "-1"});
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, HelpAndVersionEndWith0) {
  EXPECT_EQ(call({"--help"}), 0);
  expect_words(out_, {"Copies a file.", "--threads", "--json", "--force", "--quiet", "--version", "--scale"});
  EXPECT_EQ(call({"--version"}), 0);
  expect_words(out_, {"supine-copy", "OpenBLAS"});
}

TEST_F(ToolMain, NothingIsOverwrittenWithoutForce) {
  copy();
  write_text(in(), "new");
  EXPECT_EQ(copy(), 2);
  expect_words(err_, {"exists", "--force"});
  EXPECT_EQ(read_text(target()), "abc");
  EXPECT_EQ(copy({"--force"}), 0);
  EXPECT_EQ(read_text(target()), "new");
}

TEST_F(ToolMain, ASidecarThatExistsIsNotOverwrittenEither) {
  write_text(folder_ / "out/copy.json", "mine");
  EXPECT_EQ(copy(), 2);
  EXPECT_EQ(read_text(folder_ / "out/copy.json"), "mine");
  EXPECT_FALSE(std::filesystem::exists(target()));
}

TEST_F(ToolMain, AnOutputFolderThatIsAFileIsNamed) {
  write_text(folder_ / "out", "a file");
  EXPECT_EQ(copy(), 2);
  expect_words(err_, {"out", "-o"});
}

TEST_F(ToolMain, AnInputThatIsNotThereIsNamed) {
  EXPECT_EQ(call({"/no/such/file", "-o", target()}), 2);
  expect_words(err_, {"/no/such/file"});
  EXPECT_EQ(files_written(), 0u);
}

TEST_F(ToolMain, StandardOutputThatIsFullIsAnErrorAndNothingIsWritten) {
  const auto call_with_full_output = [this](const std::vector<std::string>& more) {
    [[maybe_unused]] const auto* full = std::freopen("/dev/full", "w", stdout);
    std::vector<std::string> arguments = {in(), "-o", target()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    call_and_exit(arguments);
  };
  for (const auto& more : {std::vector<std::string>{"--json"}, {}, {"--help"}, {"--version"}}) {
    EXPECT_EXIT(call_with_full_output(more), testing::ExitedWithCode(2), "supine-copy: error: ");
    EXPECT_EQ(files_written(), 0u);
  }
}

TEST_F(ToolMain, ChecksOfNumbersSayWhatIsWanted) {
  const auto said = [](const CLI::Validator& check, std::string text) { return check(text); };
  EXPECT_EQ(said(above_zero(), "0.5"), "");
  EXPECT_EQ(said(above_zero(), "0"), "0 is no number above 0");
  EXPECT_EQ(said(above_zero(), "nan"), "nan is no number above 0");
  EXPECT_EQ(said(above_zero(), "1e400"), "1e400 is no number above 0");
  EXPECT_EQ(said(not_below_zero(), "0"), "");
  EXPECT_EQ(said(not_below_zero(), "-1"), "-1 is no number from 0 up");
  EXPECT_EQ(said(not_below_zero(), "1,5"), "1,5 is no number from 0 up");
  EXPECT_EQ(said(within(0, 10), "10"), "");
  EXPECT_EQ(said(within(0, 10), "10.5"), "10.5 is no number in 0 to 10");
  EXPECT_EQ(said(within(0, 10), "nan"), "nan is no number in 0 to 10");
}

TEST(RunOfATool, GivesItsListenerEveryLineAndPrintsNone) {
  pipeline::Run run("supine-test", false, true, false, 1, nlohmann::ordered_json::object());
  std::vector<std::pair<Said, std::string>> heard;
  run.listen([&heard](Said kind, const std::string& line) { heard.emplace_back(kind, line); });
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  run.say("a line");
  run.warn("careful");
  run.progress("half way");
  EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "");
  const std::vector<std::pair<Said, std::string>> expected = {
      {Said::line, "a line"}, {Said::warning, "careful"}, {Said::progress, "half way"}};
  EXPECT_EQ(heard, expected);
}

}  // namespace
}  // namespace supine::pipeline
