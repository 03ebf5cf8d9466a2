// SPDX-License-Identifier: AGPL-3.0-or-later
#include "cohort/result_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/suggestion.h"
#include "simulation/parameters.h"

namespace supine::cohort {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// |ln| of a Bayes factor that no scan gives: of a million points each 40 sigma off.
constexpr double largest_ln_factor = 1e9;
constexpr double rounding = 1e-9;  // relative; numbers are written with all their digits
const std::vector<std::string> verdicts = {"nothing_missing", "missing", "ambiguous", "unexplained"};

/// One result, and what is told of a key that cannot be.
class Result {
 public:
  explicit Result(fs::path file) : file_(std::move(file)) {}

  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& must) const {
    throw InputError(
        fmt::format("{}: {} is {}: must be {}; run the stage again that wrote it", file_.string(), key, value, must));
  }
  double between(const std::string& key, const Json& number, double low, double high) const {
    const double value = number.get<double>();
    if (!(value >= low - rounding && value <= high + rounding))
      refuse(key, number.dump(), fmt::format("{} to {}", low, high));
    return value;
  }
  double at_least_0(const std::string& key, const Json& number) const {
    const double value = number.get<double>();
    if (!(value >= 0)) refuse(key, number.dump(), "at least 0");
    return value;
  }
  double above_0(const std::string& key, const Json& number) const {
    const double value = number.get<double>();
    if (!(value > 0)) refuse(key, number.dump(), "above 0");
    return value;
  }
  /// Where it is there, and known.
  void at_least_0_if_known(const std::string& key, const Json& of) const {
    if (of.contains(key) && !of.at(key).is_null()) at_least_0(key, of.at(key));
  }
  /// Two numbers, the lower first.
  std::pair<double, double> interval(const std::string& key, const Json& ends) const {
    if (!ends.is_array() || ends.size() != 2 || !ends[0].is_number() || !ends[1].is_number())
      refuse(key, ends.dump(), "two numbers");
    if (ends[0] > ends[1]) refuse(key, ends.dump() + ", its lower end above the upper", "the lower first");
    return {ends[0], ends[1]};
  }
  void once(std::set<std::string>& known, const std::string& key, const std::string& name) const {
    if (!known.insert(name).second) refuse(key, "there twice", "told once");
  }

 private:
  fs::path file_;
};

void check_parameter(const Result& result, const Json& p) {
  const std::string name = p.at("name"), key = "parameters[] " + name, unit = p.at("unit");
  if (const simulation::Parameter* row = simulation::find_parameter(name); row != nullptr && row->unit != unit)
    result.refuse(key + " unit", unit, row->unit);
  const auto [low, high] = result.interval(key + " interval95", p.at("interval95"));
  const double value = p.at("value"), slack = rounding * std::abs(value);
  if (!(value >= low - slack && value <= high + slack))
    result.refuse(key + " value", p.at("value").dump(), fmt::format("in its interval95, {} to {}", low, high));
}

const Json* parameter_of(const Json& calibration, const std::string& name) {
  for (const Json& p : calibration.at("parameters"))
    if (p.at("name") == name) return &p;
  return nullptr;
}

void check_coordinate(const Result& result, const Json& calibration, const Json& c) {
  const std::string name = c.at("name"), key = "worth.coordinates[] " + name;
  for (const char* sd : {"sd", "prior_sd"})
    if (c.contains(sd) && !c.at(sd).is_null()) result.above_0(fmt::format("{} {}", key, sd), c.at(sd));
  if (c.contains("likelihood") && !c.at("likelihood").is_null()) {
    if (!c.at("likelihood").at("mean").is_number()) result.refuse(key + " likelihood.mean", "none", "a number");
    result.above_0(key + " likelihood.sd", c.at("likelihood").at("sd"));
  }
  const Json* p = parameter_of(calibration, name);
  if (p == nullptr) result.refuse(key, "of no parameter", "one of parameters[]");
  if (c.at("coordinate") != "ln(value)") return;
  const double value = result.above_0("parameters[] " + name + " value", p->at("value"));
  if (!c.contains("at")) return;
  const double at = c.at("at");
  if (!(std::abs(std::log(value) - at) <= 1e-6))
    result.refuse(key + " at", c.at("at").dump(),
                  fmt::format("ln of the value {}, which is {}", value, std::log(value)));
}

void check_number(const Result& result, const std::string& effect, const Json& n) {
  const std::string name = n.at("name"), key = fmt::format("singles[] {} {}", effect, name);
  if (!name.starts_with(effect + ".")) result.refuse(key, "a number of another effect", effect + ".…");
  if (!n.at("sd").is_null()) result.above_0(key + " sd", n.at("sd"));  // none: at an end of its range
  result.above_0(key + " prior_sd", n.at("prior_sd"));
  result.at_least_0(key + " null_sd", n.value("null_sd", Json(0.0)));
  result.at_least_0(key + " usual_moves_mm", n.at("usual_moves_mm"));
}

void check_singles(const Result& result, const Json& singles, const std::set<std::string>& included) {
  std::set<std::string> known;
  for (const Json& single : singles) {
    const std::string effect = single.at("effect"), key = "singles[] " + effect;
    result.once(known, key, effect);
    if (!included.empty() && included.count(effect) == 0)
      result.refuse(key, "an effect that was not weighed",
                    listed(std::vector<std::string>(included.begin(), included.end())));
    if (!single.at("ln_bayes_factor").is_null())
      result.between(key + " ln_bayes_factor", single.at("ln_bayes_factor"), -largest_ln_factor, largest_ln_factor);
    for (const Json& n : single.at("numbers")) check_number(result, effect, n);
  }
}

void check_verdict(const Result& result, const Json& diagnosis, const std::set<std::string>& included) {
  const std::string verdict = diagnosis.at("verdict");
  if (std::find(verdicts.begin(), verdicts.end(), verdict) == verdicts.end())
    result.refuse("verdict", verdict, listed(verdicts));
  std::set<std::string> missing;
  for (const Json& effect : diagnosis.at("missing")) {
    const std::string name = effect;
    result.once(missing, "missing " + name, name);
    if (!included.empty() && included.count(name) == 0)
      result.refuse("missing", name, listed(std::vector<std::string>(included.begin(), included.end())));
  }
  if (verdict == "missing" && missing.empty()) result.refuse("missing", "empty", "what the verdict missing names");
  if (verdict == "nothing_missing" && !missing.empty())
    result.refuse("missing", diagnosis.at("missing").dump(), "empty, as the verdict is nothing_missing");
}

}  // namespace

void check_calibration(const Json& calibration, const fs::path& file) {
  const Result result(file);
  std::set<std::string> names, coordinates;
  result.at_least_0_if_known("rms_mm", calibration);
  for (const Json& p : calibration.value("parameters", Json::array())) {
    result.once(names, "parameters[] " + p.at("name").get<std::string>(), p.at("name"));
    check_parameter(result, p);
  }
  for (const Json& c : calibration.value(Json::json_pointer("/worth/coordinates"), Json::array())) {
    result.once(coordinates, "worth.coordinates[] " + c.at("name").get<std::string>(), c.at("name"));
    check_coordinate(result, calibration, c);
  }
}

void check_diagnosis(const Json& diagnosis, const fs::path& file) {
  const Result result(file);
  std::set<std::string> included;
  for (const Json& e : diagnosis.value("included", Json::array())) {
    const std::string effect = e.at("effect");
    result.once(included, "included[] " + effect, effect);
    result.between("included[] " + effect + " probability", e.at("probability"), 0, 1);
  }
  check_verdict(result, diagnosis, included);
  check_singles(result, diagnosis.value("singles", Json::array()), included);
  result.at_least_0_if_known("unexplained_mm", diagnosis);
  if (diagnosis.contains("unexplained95")) result.interval("unexplained95", diagnosis.at("unexplained95"));
}

void check_comparison(const Json& comparison, const fs::path& file) {
  const Result result(file);
  for (const char* error : {"mae_study_mm", "rms_mm"}) result.at_least_0_if_known(error, comparison);
}

}  // namespace supine::cohort
