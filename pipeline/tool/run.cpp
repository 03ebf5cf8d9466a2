// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <list>
#include <set>
#include <vector>

#include "common/error.h"
#include "pipeline/tool/hash.h"
#include "pipeline/tool/provenance.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds quiet_time{5};  // between two lines of progress where no terminal shows them

/// One JSON file: beside an output of another type, or an output of its own.
struct Sidecar {
  fs::path target;
  fs::path temporary;
  Json figures = Json::object();
};

struct Run::State {
  std::string tool;
  bool force, quiet, json;
  Json options;
  Outputs outputs;
  std::map<fs::path, fs::path> temporaries;  // target -> temporary
  std::list<Sidecar> sidecars;               // a list: references handed out stay valid
  std::map<fs::path, fs::path> input_paths;  // canonical -> as given
  Json inputs = Json::array();
  std::vector<std::string> warnings;
  Json stages = Json::object();
  std::string current_stage;
  Clock::time_point started = Clock::now(), stage_started = started;
  Clock::time_point last_line = started;
  bool progress_shown = false;
  std::vector<fs::path> no_longer_needed;
  std::function<void(Said, const std::string&)> listener;

  explicit State(bool force_outputs) : force(force_outputs), outputs(force_outputs) {}

  void clear_progress() {
    if (progress_shown) std::fputs("\r\033[K", stderr);
    progress_shown = false;
  }

  void stop_stage(Clock::time_point now) {
    if (current_stage.empty()) return;
    const double seconds = std::chrono::duration<double>(now - stage_started).count();
    stages[current_stage] = stages.value(current_stage, 0.0) + seconds;
  }

  Sidecar& sidecar_of(const fs::path& output) {
    const fs::path target = fs::path(output).replace_extension(".json");
    for (Sidecar& sidecar : sidecars)
      if (sidecar.target == target) return sidecar;
    sidecars.push_back({target, outputs.stage(target), Json::object()});
    return sidecars.back();
  }

  Json provenance() const {
    Json made;
    made["tool"] = tool;
    made["version"] = supine_version();
    if (!supine_commit().empty()) made["commit"] = supine_commit();
    made["options"] = reproducible_options(options);
    if (options.contains("seed")) made["seed"] = options["seed"];
    made["inputs"] = inputs;
    return made;
  }

  Json document(const Sidecar& sidecar, const Json& timing) const {
    Json whole = sidecar.figures;
    whole["warnings"] = warnings;
    whole["provenance"] = provenance();
    whole["timing"] = timing;
    return whole;
  }
};

Run::Run(std::string tool, bool force, bool quiet, bool json, int threads, Json options)
    : state_(std::make_unique<State>(force)), threads_(threads) {
  state_->tool = std::move(tool);
  state_->quiet = quiet;
  state_->json = json;
  state_->options = std::move(options);
}

Run::~Run() {
  if (state_) state_->clear_progress();
}

void Run::listen(std::function<void(Said, const std::string&)> listener) { state_->listener = std::move(listener); }

bool Run::has_listener() const { return static_cast<bool>(state_->listener); }

bool Run::force() const { return state_->force; }

const fs::path& Run::input(const fs::path& file) {
  std::error_code unresolved;
  const fs::path canonical = fs::weakly_canonical(file, unresolved);
  const auto [known, added] = state_->input_paths.emplace(canonical, file);
  if (added) {
    const fs::path bare = file.has_filename() ? file : file.parent_path();
    state_->inputs.push_back(Json{{"file", bare.filename().string()}, {"sha256", sha256(file)}});
  }
  return known->second;
}

fs::path Run::output(const fs::path& target) {
  if (const auto known = state_->temporaries.find(target); known != state_->temporaries.end()) return known->second;
  std::error_code unresolved;
  if (state_->input_paths.contains(fs::weakly_canonical(target, unresolved)))
    throw InputError(fmt::format("{} is read here, and would be replaced by what is made of it; name another output",
                                 target.string()));
  if (target.extension() == ".json") return state_->sidecar_of(target).temporary;
  const fs::path temporary = state_->outputs.stage(target);
  state_->temporaries.emplace(target, temporary);
  state_->sidecar_of(target);
  return temporary;
}

fs::path Run::bare_output(const fs::path& target) { return state_->outputs.stage(target); }

Json& Run::figures(const fs::path& output) { return state_->sidecar_of(output).figures; }

void Run::say(std::string_view line) const {
  if (state_->listener) return state_->listener(Said::line, std::string(line));
  if (state_->quiet || state_->json) return;
  state_->clear_progress();
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

void Run::warn(const std::string& line) {
  if (state_->listener) {
    state_->warnings.push_back(line);
    return state_->listener(Said::warning, line);
  }
  state_->clear_progress();
  fmt::print(stderr, "{}: warning: {}\n", state_->tool, line);
  state_->warnings.push_back(line);
}

void Run::progress(std::string_view line) const {
  if (state_->listener) return state_->listener(Said::progress, std::string(line));
  if (state_->quiet) return;
  if (isatty(STDERR_FILENO) == 0) {  // a file or a pipe: a line now and then, so that long work is never silent
    const auto now = Clock::now();
    if (now - state_->last_line < quiet_time) return;
    state_->last_line = now;
    fmt::print(stderr, "{}: {}\n", state_->tool, line);
    std::fflush(stderr);
    return;
  }
  fmt::print(stderr, "\r{}\033[K", line);
  std::fflush(stderr);
  state_->progress_shown = true;
}

void Run::stage(const std::string& name) {
  const auto now = Clock::now();
  state_->stop_stage(now);
  state_->current_stage = name;
  state_->stage_started = now;
}

void Run::no_longer_needed(const fs::path& file) { state_->no_longer_needed.push_back(file); }

void Run::finish() {
  const auto now = Clock::now();
  state_->stop_stage(now);
  const Json timing = {{"threads", threads_},
                       {"stages_s", state_->stages},
                       {"total_s", std::chrono::duration<double>(now - state_->started).count()}};
  Json printed = Json::object();
  for (const Sidecar& sidecar : state_->sidecars) {
    const Json document = state_->document(sidecar, timing);
    std::ofstream stream(sidecar.temporary);
    stream << document.dump(2) << "\n";
    stream.close();
    if (!stream) throw InputError("writing " + sidecar.target.string() + " failed; check the free space on the disk");
    if (!sidecar.figures.empty()) printed[sidecar.target.filename().string()] = document;
  }
  state_->clear_progress();
  if (state_->json) fmt::print("{}\n", printed.size() == 1 ? printed.front().dump(2) : printed.dump(2));
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw InputError("standard output cannot be written (disk full?); nothing was written");
  state_->outputs.commit();
  std::error_code none;
  for (const fs::path& file : state_->no_longer_needed) fs::remove(file, none);
}

}  // namespace supine::pipeline
