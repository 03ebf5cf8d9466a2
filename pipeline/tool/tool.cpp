// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/tool.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <new>
#include <system_error>

#include "common/error.h"
#include "pipeline/tool/provenance.h"
#include "pipeline/tool/runtime_settings.h"

namespace supine::pipeline {
namespace {

constexpr int exit_bad_input = 2;
constexpr int exit_numerical_failure = 3;

struct CommonOptions {
  int threads = 0;
  bool json = false, force = false, quiet = false;
};

void declare_common(CLI::App& app, Tool& tool, CommonOptions& common) {
  app.option_defaults()->always_capture_default();
  app.set_version_flag("--version", [&tool] { return version_text(tool.name()); });
  app.add_option("-o,--output", tool.output, "output file or folder");
  app.add_option("--threads", common.threads, "threads to use, 0 = all; changes no result")->check(CLI::Range(0, 1024));
  app.add_flag("--json", common.json, "print the figures as JSON on standard output instead of the table");
  app.add_flag("--force", common.force, "replace output files that exist");
  app.add_flag("--quiet", common.quiet, "print warnings and errors only");
}

void say_options(const Run& run, const Tool& tool, const nlohmann::ordered_json& options) {
  std::string line;
  for (const auto& [name, value] : options.items()) {
    if (value.empty() || value == false || value == "") continue;
    line += fmt::format("{}{} = {}", line.empty() ? ": " : ", ", name,
                        value.is_string() ? value.get<std::string>() : value.dump());
  }
  run.say(fmt::format("{} {}{}", tool.name(), supine_version(), line));
}

int work(Tool& tool, const CLI::App& app, const CommonOptions& common) {
  auto options = resolved_options(app);
  const int threads = use_threads(common.threads);
  options["threads"] = threads;
  Run run(tool.name(), common.force, common.quiet, common.json, threads, options);
  say_options(run, tool, options);
  const Outcome outcome = tool.run(run);
  run.finish();
  return static_cast<int>(outcome);
}

/// NaN for what is no finite number.
double number_of(const std::string& text) {
  double value = std::numeric_limits<double>::quiet_NaN();
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = parsed.ec == std::errc() && parsed.ptr == text.data() + text.size();
  return whole && std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
}

int complain(const Tool& tool, std::string_view message, int code) {
  // No fmt::print: it would throw where standard error is full.
  std::fputs(fmt::format("{}: error: {}\n", tool.name(), message).c_str(), stderr);
  return code;
}

}  // namespace

CLI::Validator above_zero() {
  return {[](const std::string& text) { return number_of(text) > 0 ? "" : text + " is no number above 0"; }, "> 0"};
}

CLI::Validator not_below_zero() {
  return {[](const std::string& text) { return number_of(text) >= 0 ? "" : text + " is no number from 0 up"; }, ">= 0"};
}

CLI::Validator within(double lower, double upper) {
  const std::string range = fmt::format("{:g} to {:g}", lower, upper);
  return {[=](const std::string& text) {
            const double number = number_of(text);
            return number >= lower && number <= upper ? "" : text + " is no number in " + range;
          },
          range};
}

int tool_main(Tool& tool, int argc, char** argv) {
  use_fitting_settings(argv);
  keep_freed_memory();
  install_interrupt_handler();
  std::signal(SIGXFSZ, SIG_IGN);  // a file larger than ulimit -f allows: the write fails, and is told as one that does
  CLI::App app(tool.summary(), tool.name());
  CommonOptions common;
  declare_common(app, tool, common);
  tool.declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stopped) {
    if (stopped.get_exit_code() == 0) {  // --help, --version
      app.exit(stopped);
      return std::cout.flush() ? 0 : complain(tool, "standard output cannot be written (disk full?)", exit_bad_input);
    }
    return complain(tool, fmt::format("{}\nRun {} --help for the options.", stopped.what(), tool.name()),
                    exit_bad_input);
  }
  try {
    return work(tool, app, common);
  } catch (const InputError& error) {
    return complain(tool, error.what(), exit_bad_input);
  } catch (const NumericalFailure& error) {
    return complain(tool, error.what(), exit_numerical_failure);
  } catch (const std::filesystem::filesystem_error& error) {
    return complain(tool, fmt::format("{}: {}; nothing was written", error.path1().string(), error.code().message()),
                    exit_bad_input);
  } catch (const std::system_error& error) {  // files, and standard output that is full
    return complain(tool, fmt::format("{}; nothing was written", error.what()), exit_bad_input);
  } catch (const std::bad_alloc&) {
    return complain(tool, "out of memory; use a coarser volume or fewer triangles", exit_numerical_failure);
  } catch (const std::exception& error) {
    return complain(tool, fmt::format("{} (this should not happen; please report it)", error.what()),
                    exit_numerical_failure);
  }
}

}  // namespace supine::pipeline
