// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/answer.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "diagnosis/evidence/unlisted.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string listed(const Json& names, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? fmt::format(" {} ", last) : ", ";
    text += words(names[i].get<std::string>());
  }
  return text;
}

/// A number of @p json under @p key, when it is there and is one.
double number(const Json& json, const char* key, double otherwise = std::nan("")) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : otherwise;
}

const Json* candidate(const Json& diagnosis, const std::string& effect) {
  const auto all = diagnosis.find("candidates");
  if (all == diagnosis.end()) return nullptr;
  for (const Json& c : *all)
    if (c.value("effect", "") == effect) return &c;
  return nullptr;
}

Json error_of(const Case& measured, const Collected& collected) {
  struct Row {
    std::string file;
    const char* whose;
  };
  const std::string file = Case::file_of("comparison", measured.predicted().name, ".json");
  for (const Row& row : {Row{"calibrated/" + file, "calibrated model"}, {file, "model as given"}}) {
    const Json& found = collected.find(row.file);
    if (found.is_null()) continue;
    if (!(number(found, "rms_mm") >= 0))
      throw InputError(fmt::format("{}: rms_mm is {}, and must be a number >= 0; compare again", row.file,
                                   found.value("rms_mm", Json()).dump()));
    return {{"rms_mm", found.value("rms_mm", Json())},
            {"mae_mm", found.value("mae_mm", Json())},
            {"noise_mm", found.value("noise_mm", Json())},
            {"of", row.whose},
            {"file", row.file}};
  }
  return nullptr;
}

/// With a sign that is as wide as the plus.
std::string signed_mm(double value) { return fmt::format("{}{:.1f} mm", value < 0 ? "−" : "+", std::abs(value)); }

/// "lateral edge −1.5 mm (49 cm²)" for the largest few.
std::string where(const Json& diagnosis) {
  std::string text;
  const Json spots = diagnosis.value("hot_spots", Json::array());
  for (std::size_t s = 0; s < std::min<std::size_t>(3, spots.size()); ++s)
    text += fmt::format("{}{} {} ({:.0f} cm²)", s > 0 ? ", " : "", spots[s].value("area", "?"),
                        signed_mm(number(spots[s], "mean_signed_mm")), number(spots[s], "area_cm2"));
  return text;
}

std::string next_measurement(const Json& diagnosis, const char* body) {
  const Json next = diagnosis.value("next_measurement", Json::array());
  if (next.empty()) return "measure another pose";
  const double separation = number(next[0], "separation", 0);
  const std::string pair = next[0].value("closest_pair", "");
  return fmt::format("measure the {} {}{}", body, next[0].value("measurement", "in another pose"),
                     separation > 0 && !pair.empty()
                         ? fmt::format(": it would separate {} by {:.0f} (9 is enough)", words(pair), separation)
                         : "");
}

void tell_missing(const Json& diagnosis, const Places& places, Answer& answer) {
  const std::string effect = diagnosis["missing"][0];
  const Json* found = candidate(diagnosis, effect);
  answer.sentence = fmt::format("The model lacks {}", listed(diagnosis["missing"], "and"));
  if (found != nullptr && found->contains("probability"))
    answer.sentence += fmt::format(" (probability {:.2f})", number(*found, "probability"));
  const double with = found != nullptr ? number(*found, "held_out_rms_mm") : std::nan("");
  const double without = number(diagnosis, "base_held_out_rms_mm");
  if (with < without)
    answer.sentence +=
        fmt::format(": with it, skin that was not fitted is predicted to {:.2f} mm instead of {:.2f}", with, without);
  else if (std::isfinite(with))
    answer.sentence += fmt::format(
        ", but skin that was not fitted is predicted no better with it: {:.2f} mm, {:.2f} "
        "without",
        with, without);
  answer.sentence += ".";
  answer.next = fmt::format("Add {} to the model and calibrate again.", words(effect));
  answer.command = fmt::format("build/bin/supine-model add {} {}/model.toml && {}", effect, places.case_name,
                               places.make("calibrate"));
}

/// Whether the best of the catalogue has any probability at all, where that is told.
bool may_be_close(const Json& diagnosis, const Json& missing) {
  constexpr double worth_naming = 0.01;
  if (missing.empty()) return false;
  for (const Json& one : diagnosis.value("included", Json::array()))
    if (one.value("effect", "") == missing[0].get<std::string>()) return number(one, "probability") >= worth_naming;
  return true;
}

/// "supine-model add local_muscle … --with offset_mm=-4.1": a local cause that was followed, as a command; else empty.
std::string add_local_cause(const Json& diagnosis, const Places& places) {
  const Json effect = diagnosis.value("unlisted", Json::object()).value("effect", Json());
  if (!effect.is_object()) return "";
  std::string numbers;
  for (const auto& [name, value] : effect.items())
    if (name != "name")
      numbers += fmt::format(" --with {}={}", name,
                             value.is_number() ? fmt::format("{:.3g}", value.get<double>()) : value.get<std::string>());
  return fmt::format("build/bin/supine-model add {} {}/model.toml{} && {}", effect.value("name", "?"), places.case_name,
                     numbers, places.make("calibrate"));
}

void tell_unexplained(const Json& diagnosis, const char* body, Answer& answer) {
  const Json missing = diagnosis.value("missing", Json::array());
  answer.kind = "unexplained";
  answer.sentence = fmt::format("The model is off in a way that no effect of the catalogue explains{}.",
                                may_be_close(diagnosis, missing) ? "; closest: " + listed(missing, "or") : "");
  answer.next = fmt::format("Look at the map below, check scan and segmentation there, and {}.",
                            next_measurement(diagnosis, body));
}

/// Where no effect is to be added, the local cause may be.
void offer_local_cause(const Json& diagnosis, const Places& places, Answer& answer) {
  const double probability = number(diagnosis.value("unlisted", Json::object()), "probability");
  if (!answer.command.empty() || !(answer.kind == "unexplained" || probability >= diagnosis::worth_telling)) return;
  answer.command = add_local_cause(diagnosis, places);
  if (!answer.command.empty()) answer.next += " Or put the local cause into the model and see what it leaves.";
}

void tell_diagnosis(const Json& diagnosis, const Places& places, const char* body, Answer& answer) {
  const std::string verdict = diagnosis.value("verdict", "");
  const Json missing = diagnosis.value("missing", Json::array());
  const std::string why = diagnosis.value("why", "");
  answer.kind = verdict;
  if (verdict == "missing" && !missing.empty()) return tell_missing(diagnosis, places, answer);
  if (verdict == "nothing_missing") {
    answer.sentence = fmt::format("Nothing is missing: {}.", why);
    answer.next = "Use the calibrated model.";
  } else if (verdict == "ambiguous") {
    const Json hypotheses = diagnosis.value("hypotheses", Json::array());
    const bool may_be = !hypotheses.empty() && hypotheses[0].value("effects", Json::array()).empty();
    answer.sentence =
        may_be ? fmt::format("Whether {} is missing this scan cannot tell.", listed(missing, "or"))
               : fmt::format("Something is missing, and this scan cannot tell which: {}.", listed(missing, "or"));
    answer.next = fmt::format("To tell them apart, {}.", next_measurement(diagnosis, body));
  } else {
    tell_unexplained(diagnosis, body, answer);
  }
  offer_local_cause(diagnosis, places, answer);
}

/// "The supine scan lies 2.1 mm and 0.8° from where it was said to lie."
std::string place_of_scan(const Json& place) {
  const auto length = [&place](const char* key) {
    double squares = 0;
    for (const Json& component : place.at(key)) squares += std::pow(component.get<double>(), 2);
    return std::sqrt(squares);
  };
  return fmt::format("The {} scan lies {:.1f} mm and {:.1f}° from where it was said to lie.", place.value("pose", "?"),
                     length("shift_mm"), length("turn_deg"));
}

/// "Something local that is not listed has probability 0.98: the muscle about (12, -40, 33) mm …"; empty where it is
/// hardly likelier than it was before.
std::string unlisted_cause(const Json& unlisted) {
  if (!(number(unlisted, "probability") >= diagnosis::worth_telling)) return "";
  const Json &place = unlisted.at("place_mm"), &reach = unlisted.at("interval95");
  const bool moved = unlisted.contains("moved_mm");
  const double size = number(unlisted, moved ? "moved_mm" : "times_as_stiff");
  const double sign = moved && size < 0 ? -1 : 1;
  const auto [low, high] = std::minmax({sign * reach[0].get<double>(), sign * reach[1].get<double>()});
  const char* how = sign < 0 ? "mm deeper" : moved ? "mm further outward" : "times as stiff";
  return fmt::format(
      "Something local that no effect lists has probability {:.2f}: the {} about ({:.0f}, {:.0f}, {:.0f}) mm {} {:.2g} "
      "{} (95 %: {:.2g} to {:.2g}).",
      number(unlisted, "probability"), unlisted.value("likeliest", "?"), place[0].get<double>(), place[1].get<double>(),
      place[2].get<double>(), moved ? "lies" : "is", sign * size, how, low, high);
}

void add_facts(const Json& diagnosis, const Collected& collected, const char* body, Answer& answer) {
  if (const std::string spots = where(diagnosis); !spots.empty())
    answer.facts.push_back(
        fmt::format("Where it is off: {} (plus: the {} reaches further than the model).", spots, body));
  if (const double left = number(diagnosis, "unexplained_mm"); std::isfinite(left))
    answer.facts.push_back(fmt::format("No effect explains {:.1f} mm of it (95 %: {:.1f} to {:.1f}).", left,
                                       diagnosis["unexplained95"][0].get<double>(),
                                       diagnosis["unexplained95"][1].get<double>()));
  if (const std::string local = unlisted_cause(diagnosis.value("unlisted", Json::object())); !local.empty())
    answer.facts.push_back(local);
  for (const Json& place : diagnosis.value("registration", Json::array())) answer.facts.push_back(place_of_scan(place));
  if (const Json& fit = collected.find("calibration.json"); fit.is_object() && fit.contains("as_given"))
    answer.facts.push_back(fmt::format(
        "With the scans there, and everything else as it was found, the calibrated model is {:.2f} mm off (RMS over "
        "what was fitted) in place of {:.2f}.",
        number(fit, "rms_mm"), number(fit["as_given"], "rms_mm")));
  if (const double creased = number(diagnosis, "creased_points"); creased > 0)
    answer.facts.push_back(
        fmt::format("{:.0f} points of the scans lie where the model's skin creases; they count for little.", creased));
  // Where something is missing these may have stood in for it.
  const std::string verdict = diagnosis.value("verdict", "");
  if (verdict != "missing" && verdict != "ambiguous")
    for (const Json& far : diagnosis.value("unexpected", Json::array()))
      answer.facts.push_back("Otherwise than expected, " + far.value("in_words", "?") + ".");
  if (const double triangles = number(diagnosis, "finer_triangles"); triangles > 0)
    answer.facts.push_back(fmt::format(
        "The mesh errs by {:.1f} mm, more than the scan or anything else: a finer one (TRIANGLES={:.0f}) may "
        "show more.",
        number(diagnosis.value("budget_mm", Json::object()), "numerical"), triangles));
  Json blind = Json::array();
  for (const Json& effect : diagnosis.value("cannot_see", Json::array())) blind.push_back(effect.value("effect", "?"));
  if (!blind.empty()) answer.facts.push_back("This scan could not show: " + listed(blind, "and") + ".");
  const Json& ladder = collected.first({"ladder/ladder.json", "ladder.json"});
  if (!ladder.is_object() || !ladder.contains("rungs") || ladder["rungs"].size() < 2) return;
  const Json &first = ladder["rungs"].front(), &last = ladder["rungs"].back();
  answer.facts.push_back(
      fmt::format("Climbing the ladder, the held-out error goes from {:.2f} to {:.2f} mm; noise and mesh alone leave "
                  "{:.2f}.",
                  number(first, "held_out_rms_mm"), number(last, "held_out_rms_mm"), number(ladder, "noise_floor_mm")));
}

}  // namespace

namespace {

/// What a person has to know before the sentence: that it may be of something else. Empty where all belongs together.
std::string out_of_date(const std::vector<Stage>& stages, std::initializer_list<std::string_view> names) {
  for (const Stage& stage : stages)
    if (!stage.stale.empty() && std::find(names.begin(), names.end(), stage.name) != names.end())
      return fmt::format("Out of date, {}: ", stage.stale);
  return {};
}

}  // namespace

Answer answer_of(const Case& measured, const Collected& collected, const std::vector<Stage>& stages,
                 const Places& places) {
  Answer answer;
  answer.error = error_of(measured, collected);
  const Json& diagnosis = collected.first({"diagnosis.json", "ladder/diagnosis.json"});
  if (!diagnosis.is_null()) {
    const char* body = measured.is_object() ? "body" : "breast";
    tell_diagnosis(diagnosis, places, body, answer);
    add_facts(diagnosis, collected, body, answer);
    if (const std::string stale = out_of_date(stages, {"mesh", "diagnose"}); !stale.empty()) {
      answer.sentence = stale + answer.sentence;
      answer.next = "Diagnose again.";
      answer.command = places.make("diagnose");
    }
    return answer;
  }
  const bool has_scan = std::any_of(measured.poses.begin(), measured.poses.end(),
                                    [](const Pose& pose) { return pose.surface.has_value(); });
  const auto gap = std::find_if(stages.begin(), stages.end(),
                                [](const Stage& stage) { return stage.file.empty() && stage.name != "sensitivity"; });
  const std::string pose = measured.predicted().name;
  if (collected.find(pose + ".json").is_null()) {
    answer.kind = "no_shape";
    answer.sentence = fmt::format("The {} shape has not been computed yet.", pose);
    answer.next = gap == stages.end() ? "" : fmt::format("The next step is {}.", gap->name);
    answer.command = places.make("simulate");
  } else if (!has_scan) {
    answer.kind = "no_scan";
    answer.sentence =
        fmt::format("The {} shape is predicted; without a measured surface nobody knows how far it is off.", pose);
    answer.next =
        measured.is_object()
            ? fmt::format("Measure the body in that pose and name the scan as `surface` in [pose.{}] of case.toml.",
                          pose)
            : "Measure the patient lying supine and name the scan as `surface` in [pose.supine] of case.toml.";
  } else {
    answer.kind = "not_diagnosed";
    answer.sentence = answer.error.is_null()
                          ? fmt::format("The {} shape is predicted, not compared with the measured surface yet.", pose)
                          : fmt::format(
                                "The {} lies {:.2f} mm RMS from the measured surface; what it lacks has not "
                                "been asked yet.",
                                answer.error["of"].get<std::string>(), number(answer.error, "rms_mm"));
    answer.sentence = out_of_date(stages, {"mesh", "simulate", "compare"}) + answer.sentence;
    answer.next = "Ask what is missing.";
    answer.command = places.make("diagnose");
  }
  return answer;
}

Json answer_json(const Answer& answer) {
  return {{"kind", answer.kind}, {"sentence", answer.sentence}, {"facts", answer.facts},
          {"next", answer.next}, {"command", answer.command},   {"error", answer.error}};
}

}  // namespace supine::pipeline
