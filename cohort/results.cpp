// SPDX-License-Identifier: AGPL-3.0-or-later
#include "cohort/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "cohort/population.h"
#include "cohort/result_checks.h"
#include "common/error.h"

namespace supine::cohort {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Ordered = nlohmann::ordered_json;

/// Of ln(modulus) between patients, 1 sigma: what is believed before any is measured.
constexpr double usual_spread = 0.5;

Json read_json(const fs::path& file) {
  if (!fs::exists(file)) return nullptr;
  if (!fs::is_regular_file(file)) throw InputError(fmt::format("{} is no file", file.string()));
  std::ifstream stream(file);
  Json read = Json::parse(stream, nullptr, false);
  if (!read.is_object())
    throw InputError(fmt::format("{} is no JSON object; run the stage again that wrote it", file.string()));
  return read;
}

std::string first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

Ordered estimate_json(const Estimate& e) { return {{"value", e.value}, {"interval95", {e.low, e.high}}}; }

/// Runs @p read, which reads a result of the case: a key that is missing or of another type is told with its file.
template <class Read>
auto reading(const CaseResults& one, const char* file, const Read& read) {
  try {
    return read();
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: not as this version writes it ({}); run the stage again that wrote it",
                                 (one.out / file).string(), error.what()));
  }
}

/// What one case says of one modulus or other free number, in its coordinate.
struct Known {
  std::string name, unit;
  Likelihood likelihood;
  std::optional<double> prior_mean;
};

Json coordinates_of(const CaseResults& one) {
  const Json::json_pointer place("/worth/coordinates");
  return one.calibration.is_object() ? one.calibration.value(place, Json::array()) : Json::array();
}

/// Earlier versions told the interval alone, in which the prior counts to an unknown part.
bool is_of_an_earlier_version(const CaseResults& one) {
  const Json coordinates = coordinates_of(one);
  return std::any_of(coordinates.begin(), coordinates.end(), [](const Json& c) { return !c.contains("likelihood"); });
}

std::vector<Known> numbers_of(const CaseResults& one) {
  std::vector<Known> known;
  if (is_of_an_earlier_version(one)) return known;
  for (const Json& c : coordinates_of(one)) {
    if (c.at("likelihood").is_null() || c.at("coordinate") != "ln(value)") continue;
    Known number{c.at("name"), "", {c.at("likelihood").at("mean"), c.at("likelihood").at("sd")}, {}};
    for (const Json& p : one.calibration.at("parameters"))
      if (p.at("name") == number.name) number.unit = p.at("unit");
    if (c.at("prior_mean").is_number()) number.prior_mean = c.at("prior_mean");
    known.push_back(number);
  }
  return known;
}

/// Where the population is believed to lie, which hardly counts: what the first case believes that has a prior.
double about(const std::vector<std::pair<const CaseResults*, Known>>& known) {
  for (const auto& [one, number] : known)
    if (number.prior_mean) return *number.prior_mean;
  return known.front().second.likelihood.mean;
}

Ordered moduli_json(const std::vector<CaseResults>& cases) {
  std::map<std::string, std::vector<std::pair<const CaseResults*, Known>>> by_name;
  for (const CaseResults& one : cases)
    for (Known& known : reading(one, "calibration.json", [&one = one] { return numbers_of(one); }))
      by_name[known.name].emplace_back(&one, std::move(known));
  Ordered list = Ordered::array();
  for (const auto& [name, known] : by_name) {
    const auto population = [&known = known](const CaseResults* left_out) {
      std::vector<Likelihood> patients;
      for (const auto& [one, number] : known)
        if (one != left_out) patients.push_back(number.likelihood);
      return patients.empty() ? std::nullopt : std::optional(pool_normal(patients, about(known), usual_spread));
    };
    const auto all = population(nullptr);
    const auto as_value = [](const Estimate& ln) {
      return Ordered{{"value", std::exp(ln.value)}, {"interval95", {std::exp(ln.low), std::exp(ln.high)}}};
    };
    Ordered row = {{"name", name},
                   {"unit", known.front().second.unit},
                   {"patients", all->patients},
                   {"median", as_value(all->mean)},
                   {"spread_ln", estimate_json(all->spread)},
                   {"of_new", {{"median", std::exp(all->of_new.mean)}, {"log_sd", all->of_new.sd}}}};
    row["left_out"] = Ordered::array();
    for (const auto& [one, number] : known)
      if (const auto others = population(one))
        row["left_out"].push_back(
            {{"patient", one->name}, {"median", std::exp(others->of_new.mean)}, {"log_sd", others->of_new.sd}});
    list.push_back(row);
  }
  return list;
}

/// What every diagnosed case says of one effect.
struct Gathered {
  EffectEvidence evidence;
  std::vector<const CaseResults*> patients;
  std::string number;           ///< of a one-number effect
  double mm_per_unit = 0;       ///< mean over the patients
  std::size_t with_number = 0;  ///< patients of whom its strength is known
  bool one_number = true;
};

void gather(const CaseResults& one, const Json& single, Gathered& into) {
  EffectEvidence::Patient patient{single.at("ln_bayes_factor"), std::nullopt};
  into.one_number = into.one_number && single.at("numbers").size() == 1;
  if (single.at("numbers").size() == 1) {
    const Json& n = single.at("numbers").front();
    const Likelihood prior{n.at("prior_mean"), n.at("prior_sd")};
    if (n.at("sd").is_number()) patient.strength = likelihood_of({n.at("mean"), n.at("sd")}, prior);
    into.number = n.at("name");
    into.evidence.prior_mean = prior.mean, into.evidence.prior_sd = prior.sd;
    into.evidence.null_sd = n.value("null_sd", 0.0);
    if (const double usual = n.at("usual"); usual != 0) {
      into.mm_per_unit += n.at("usual_moves_mm").get<double>() / std::abs(usual);
      ++into.with_number;
    }
  }
  into.evidence.patients.push_back(patient);
  into.patients.push_back(&one);
}

Ordered effects_json(const std::vector<CaseResults>& cases, const PoolOptions& options) {
  std::map<std::string, Gathered> by_effect;
  for (const CaseResults& one : cases)
    if (one.diagnosis.is_object())
      reading(one, "diagnosis.json", [&one = one, &by_effect] {
        for (const Json& single : one.diagnosis.value("singles", Json::array()))
          if (single.at("ln_bayes_factor").is_number()) gather(one, single, by_effect[single.at("effect")]);
      });
  std::vector<Ordered> rows;
  for (auto& [effect, g] : by_effect) {
    if (!g.one_number)
      for (EffectEvidence::Patient& p : g.evidence.patients) p.strength.reset();
    if (g.one_number && g.with_number > 0 && g.mm_per_unit > 0)
      g.evidence.shared_sd = options.shared_mm * static_cast<double>(g.with_number) / g.mm_per_unit;
    const Prevalence found = pool_effect(g.evidence, options.prior_probability);
    Ordered row = {{"effect", effect},
                   {"patients", g.patients.size()},
                   {"probability", found.probability},
                   {"ln_bayes_factor", found.ln_bayes_factor},
                   {"share", estimate_json(found.share)}};
    if (found.mean) row["strength"] = {{"number", g.number}, {"from_null", estimate_json(*found.mean)}};
    row["shared_error"] = found.shared ? estimate_json(*found.shared) : Ordered(nullptr);
    row["in_patient"] = Ordered::array();
    for (std::size_t i = 0; i < g.patients.size(); ++i)
      row["in_patient"].push_back({{"patient", g.patients[i]->name}, {"probability", found.in_patient[i]}});
    rows.push_back(row);
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Ordered& a, const Ordered& b) {
    return a.at("probability").get<double>() > b.at("probability").get<double>();
  });
  return rows;
}

std::string cell(const Json& value) {
  if (value.is_number()) return fmt::format("{}", value.get<double>());
  if (!value.is_string()) return "";
  std::string text = value.get<std::string>();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return "\"" + text + "\"";
}

Json at(const Json& from, const std::string& pointer) {
  const Json::json_pointer path(pointer);
  return from.is_object() && from.contains(path) ? from.at(path) : Json(nullptr);
}

/// The same of what is a number or is not there. @throws Json::exception  it is something else
Json number_at(const Json& from, const std::string& pointer) {
  Json value = at(from, pointer);
  if (!value.is_null()) value = value.get<double>();
  return value;
}

/// Columns of the table: name, and what stands there for a case.
using Row = std::map<std::string, Json>;

Row row_of(const CaseResults& one) {
  Row row;
  row["patient"] = one.name;
  row["failed"] = one.failed;
  row["verdict"] = at(one.diagnosis, "/verdict");
  std::string missing;
  for (const Json& effect : one.diagnosis.is_object() ? one.diagnosis.value("missing", Json::array()) : Json::array())
    missing += (missing.empty() ? "" : " ") + effect.get<std::string>();
  row["missing"] = missing;
  row["unexplained_mm"] = number_at(one.diagnosis, "/unexplained_mm");
  row["unexplained_low_mm"] = number_at(one.diagnosis, "/unexplained95/0");
  row["unexplained_high_mm"] = number_at(one.diagnosis, "/unexplained95/1");
  row["mae_study_mm"] = number_at(one.comparison, "/mae_study_mm");
  row["rms_mm"] = number_at(one.comparison, "/rms_mm");
  row["calibrated_rms_mm"] = number_at(one.calibration, "/rms_mm");
  for (const Json& p :
       one.calibration.is_object() ? one.calibration.value("parameters", Json::array()) : Json::array()) {
    const std::string name = p.at("name");
    row[name] = p.at("value"), row[name + " low"] = p.at("interval95").at(0),
    row[name + " high"] = p.at("interval95").at(1);
  }
  for (const Json& e : one.diagnosis.is_object() ? one.diagnosis.value("included", Json::array()) : Json::array())
    row["p " + e.at("effect").get<std::string>()] = e.at("probability");
  for (const Json& a : one.comparison.is_object() ? one.comparison.value("areas", Json::array()) : Json::array())
    row["mean_signed_mm " + a.at("name").get<std::string>()] = a.at("mean_signed_mm");
  return row;
}

void check_values(const CaseResults& one) {
  const auto check = [&one](const char* file, const Json& result, const auto& values) {
    if (result.is_object()) reading(one, file, [&] { values(result, one.out / file); });
  };
  check("comparison.json", one.comparison, check_comparison);
  check("calibration.json", one.calibration, check_calibration);
  check("diagnosis.json", one.diagnosis, check_diagnosis);
}

/// A folder that was copied would count its patient twice.
void check_no_copy(const std::vector<CaseResults>& cases, const char* file, const Json CaseResults::*result) {
  std::map<std::string, const CaseResults*> known;
  for (const CaseResults& one : cases) {
    if (!(one.*result).is_object()) continue;
    const auto [other, is_new] = known.emplace((one.*result).dump(), &one);
    if (!is_new)
      throw InputError(
          fmt::format("{} and {} are the same: a patient would count twice; take one of the two folders away",
                      (other->second->out / file).string(), (one.out / file).string()));
  }
}

}  // namespace

std::vector<CaseResults> read_results(const fs::path& cohort, const fs::path& out) {
  if (!fs::is_directory(cohort))
    throw InputError(fmt::format("{} is not a folder; a cohort is a folder of cases", cohort.string()));
  std::vector<CaseResults> cases;
  bool any = false;
  for (const auto& entry : fs::directory_iterator(cohort)) {
    if (!fs::exists(entry.path() / "case.toml")) continue;
    CaseResults one;
    one.name = entry.path().filename().string();
    one.out = out.empty() ? entry.path() / "out" : out / one.name;
    if (fs::exists(one.out / "failed.txt")) one.failed = first_line(one.out / "failed.txt");
    one.comparison = read_json(one.out / "comparison.json");
    one.calibration = read_json(one.out / "calibration.json");
    one.diagnosis = read_json(one.out / "diagnosis.json");
    any = any || one.comparison.is_object() || one.calibration.is_object() || one.diagnosis.is_object();
    cases.push_back(std::move(one));
  }
  std::sort(cases.begin(), cases.end(), [](const CaseResults& a, const CaseResults& b) { return a.name < b.name; });
  check_no_copy(cases, "calibration.json", &CaseResults::calibration);
  check_no_copy(cases, "diagnosis.json", &CaseResults::diagnosis);
  for (const CaseResults& one : cases) check_values(one);
  if (cases.empty())
    throw InputError(fmt::format("{} holds no case: none of its folders has a case.toml", cohort.string()));
  if (!any)
    throw InputError(fmt::format(
        "none of the {} cases of {} has a result in {}; run make COHORT={} TARGET=diagnose first", cases.size(),
        cohort.string(), out.empty() ? "NAME/out" : (out / "NAME").string(), cohort.string()));
  return cases;
}

Ordered pooled(const std::vector<CaseResults>& cases, const PoolOptions& options) {
  std::size_t diagnosed = 0, without_singles = 0, without_likelihood = 0;
  Ordered set_aside = Ordered::array(), verdicts = Ordered::object();
  for (const CaseResults& one : cases) {
    if (!one.failed.empty()) set_aside.push_back({{"patient", one.name}, {"message", one.failed}});
    without_likelihood += is_of_an_earlier_version(one);
    if (!one.diagnosis.is_object()) continue;
    ++diagnosed;
    without_singles += !one.diagnosis.contains("singles");
    const auto verdict =
        reading(one, "diagnosis.json", [&one = one] { return one.diagnosis.value("verdict", std::string()); });
    verdicts[verdict] = verdicts.value(verdict, 0) + 1;
  }
  return {{"patients", cases.size()},
          {"diagnosed", diagnosed},
          {"diagnosed_by_an_earlier_version", without_singles},
          {"calibrated_by_an_earlier_version", without_likelihood},
          {"set_aside", set_aside},
          {"verdicts", verdicts},
          {"shared_mm", options.shared_mm},
          {"prior_probability", options.prior_probability},
          {"numbers", moduli_json(cases)},
          {"effects", effects_json(cases, options)}};
}

std::string table_csv(const std::vector<CaseResults>& cases) {
  static const std::vector<std::string> first = {"patient",
                                                 "failed",
                                                 "verdict",
                                                 "missing",
                                                 "unexplained_mm",
                                                 "unexplained_low_mm",
                                                 "unexplained_high_mm",
                                                 "mae_study_mm",
                                                 "rms_mm",
                                                 "calibrated_rms_mm"};
  std::vector<Row> rows;
  std::set<std::string> others;
  for (const CaseResults& one : cases) {
    rows.push_back(
        reading(one, "comparison.json, calibration.json or diagnosis.json", [&one = one] { return row_of(one); }));
    for (const auto& [column, value] : rows.back())
      if (std::find(first.begin(), first.end(), column) == first.end()) others.insert(column);
  }
  std::vector<std::string> columns = first;
  columns.insert(columns.end(), others.begin(), others.end());
  std::string text;
  for (std::size_t c = 0; c < columns.size(); ++c) text += (c == 0 ? "" : ",") + cell(columns[c]);
  text += "\n";
  for (const Row& row : rows) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const auto found = row.find(columns[c]);
      text += (c == 0 ? "" : ",") + (found == row.end() ? std::string() : cell(found->second));
    }
    text += "\n";
  }
  return text;
}

}  // namespace supine::cohort
