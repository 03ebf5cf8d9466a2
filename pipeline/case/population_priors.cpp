// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/population_priors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// What a number's row says to this patient: of the others where he is among them.
const Json& told_to(const std::string& patient, const Json& row, bool& left_out) {
  for (const Json& one : row.at("left_out"))
    if (one.at("patient") == patient) {
      left_out = true;
      return one;
    }
  return row.at("of_new");
}

void set_prior(const fs::path& file, const std::string& name, const Json& told, simulation::Setting& setting) {
  const double median = told.at("median"), log_sd = told.at("log_sd");
  constexpr double widest = 5;  // a factor of 150: no population
  if (!(median > 0 && median >= setting.lower && median <= setting.upper && log_sd > 0 && log_sd <= widest))
    throw InputError(
        fmt::format("{}: {} has the median {} and the log_sd {}; the model allows {} to {}, and a log_sd of 0 to {}",
                    file.string(), name, median, log_sd, setting.lower, setting.upper, widest));
  setting.value = median;
  setting.prior_sd = median * std::expm1(log_sd);  // log-sd = ln(1 + prior_sd / value)
}

}  // namespace

simulation::Model with_population(Run& run, const Case& description, simulation::Model model) {
  if (!description.cohort) return model;
  const fs::path& file = *description.cohort;
  std::ifstream stream(run.input(file));
  const Json read = Json::parse(stream, nullptr, false);
  const std::vector<std::string> free = simulation::free_parameters(model);
  const std::string patient = fs::weakly_canonical(description.folder / "case.toml").parent_path().filename().string();
  std::vector<std::string> set;
  std::set<std::string> told;
  bool left_out = false;
  try {
    for (const Json& row : read.at("numbers")) {
      const std::string name = row.at("name");
      if (!told.insert(name).second)
        throw InputError(
            fmt::format("{}: numbers[] has {} twice; keep one of the two rows, or take a copy of what supine-cohort "
                        "wrote",
                        file.string(), name));
      if (std::find(free.begin(), free.end(), name) == free.end()) continue;
      set_prior(file, name, told_to(patient, row, left_out), *simulation::find_setting(model, name));
      set.push_back(name);
    }
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{} is no cohort.json as supine-cohort writes it ({})", file.string(), error.what()));
  }
  if (set.empty())
    throw InputError(
        fmt::format("{} says nothing of the free numbers of the model ({})", file.string(), fmt::join(free, ", ")));
  run.say(fmt::format("  priors of {} from {}, {}", fmt::join(set, ", "), file.filename().string(),
                      left_out ? "of the others: this patient is left out" : "of which this patient is none"));
  return model;
}

}  // namespace supine::pipeline
