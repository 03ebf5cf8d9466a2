// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/outputs.h"

namespace supine::pipeline {

/// What a finished tool says to the shell. (2 bad input and 3 numerical failure come from exceptions.)
enum class Outcome { done = 0, target_not_met = 1 };

/// The kinds of lines a run says.
enum class Said { line, warning, progress };

/// One run of a tool: its common options, its inputs and outputs, its report.
class Run {
 public:
  Run(std::string tool, bool force, bool quiet, bool json, int threads, nlohmann::ordered_json options);

  /// Gives @p listener every line of the run, in place of standard output and standard error. Threads may call it, one
  /// at a time; what it throws ends the run.
  void listen(std::function<void(Said, const std::string& line)> listener);
  bool has_listener() const;

  int threads() const { return threads_; }
  /// Whether existing files may be replaced.
  bool force() const;

  /// Notes an input file, whose hash goes into the provenance. @throws InputError when it cannot be read
  const std::filesystem::path& input(const std::filesystem::path& file);

  /// The temporary path to write the output @p target to; see Outputs::stage.
  /// @throws InputError  an input of this run
  std::filesystem::path output(const std::filesystem::path& target);

  /// The same for a file that has no sidecar of its own: a .json in the format of another program.
  std::filesystem::path bare_output(const std::filesystem::path& target);

  /// The figures of the sidecar that goes beside @p output (X.ext → X.json): fill in at will, keys as in the docs.
  /// An output that is itself X.json has no other sidecar: its figures are the file.
  nlohmann::ordered_json& figures(const std::filesystem::path& output);

  /// A line for a person, on standard output; silent with --quiet or --json.
  void say(std::string_view line) const;
  /// A caution for a person on standard error, kept in every sidecar under "warnings".
  void warn(const std::string& line);
  /// Says on standard error how far it is: on a terminal one line that is overwritten, else a line of its own when
  /// none was said for 5 seconds; silent with --quiet.
  void progress(std::string_view line) const;

  /// Starts the named stopwatch of the sidecar's `timing` block and stops the one before.
  void stage(const std::string& name);

  /// A file that helps an interrupted run to go on: removed once the outputs are there.
  void no_longer_needed(const std::filesystem::path& file);

  /// Writes the sidecars and makes all outputs appear. Called by tool_main; a tool that throws before leaves nothing.
  void finish();

  ~Run();

 private:
  struct State;
  std::unique_ptr<State> state_;
  int threads_;
};

/// Checks of an option that is one finite number: above zero; zero or more; in a range, which CLI::Range lets NaN into.
CLI::Validator above_zero();
CLI::Validator not_below_zero();
CLI::Validator within(double lower, double upper);

/// A command-line tool. Declares its options, then runs once.
class Tool {
 public:
  virtual ~Tool() = default;
  virtual std::string name() const = 0;     ///< "supine-segment"
  virtual std::string summary() const = 0;  ///< a sentence, then examples; shown by --help
  /// Adds positionals and options to @p app. -o, --threads, --json, --force, --quiet, --help, --version are there
  /// already.
  virtual void declare(CLI::App& app) = 0;
  virtual Outcome run(Run& run) = 0;

  std::filesystem::path output;  ///< what -o named; empty when it was not given
};

/// Parses, runs, catches, prints one clear message and returns the exit code:
/// 0 done, 1 target not met, 2 bad input or usage, 3 numerical failure, 130 interrupted.
int tool_main(Tool& tool, int argc, char** argv);

}  // namespace supine::pipeline
