// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/evidence/nuisance_words.h"
#include "diagnosis/over_sets.h"
#include "diagnosis/size_named.h"
#include "pipeline/results/diagnosis_report.h"

namespace supine::pipeline {
namespace {

using diagnosis::Findings;
using diagnosis::Refit;
using diagnosis::Verdict;

std::string values_of(const std::vector<diagnosis::FittedParameter>& parameters) {
  std::string text;
  for (const auto& p : parameters) {
    const std::string unit = p.unit == "1" ? "" : " " + p.unit;
    text += fmt::format("{}{} ", text.empty() ? "" : ", ", p.name.substr(p.name.find('.') + 1));
    // At an end of its range a fit knows the other side alone.
    if (p.end == diagnosis::RangeEnd::none)
      text += fmt::format("{:.2g} [{:.2g}, {:.2g}]{}", p.value, p.low, p.high, unit);
    else
      text += p.end == diagnosis::RangeEnd::upper ? fmt::format("at least {:.2g}{}", p.low, unit)
                                                  : fmt::format("at most {:.2g}{}", p.high, unit);
    if (p.end == diagnosis::RangeEnd::none && p.name.ends_with(".log_ratio"))
      text += fmt::format(" (x {:.2g} [{:.2g}, {:.2g}])", std::exp(p.value), std::exp(p.low), std::exp(p.high));
  }
  return text;
}

std::string joined(const std::vector<std::string>& names, const char* between) {
  return fmt::format("{}", fmt::join(names, between));
}

void say_places(const Run& run, const Findings& found) {
  for (const diagnosis::ScanPlace& place : found.places)
    run.say(fmt::format("  the {} scan lies {:.1f} ± {:.1f} mm and {:.1f} ± {:.1f}° from where it was said to lie",
                        place.pose, place.shift_mm.norm(), place.sd.head<3>().norm() / std::sqrt(3.0),
                        place.turn_deg.norm(), place.sd.tail<3>().norm() / std::sqrt(3.0)));
}

/// Points that count for little, and why.
void say_creases(const Run& run, const Findings& found) {
  const auto creased = found.base.creased_points;
  if (creased == 0) return;
  run.say(fmt::format(
      "  {} points of the scans ({:.0f} %) lie where the model's skin creases, as each mesh does otherwise: "
      "they count for little",
      creased, 100 * static_cast<double>(creased) / static_cast<double>(found.base.fit.residuals.skin_rows())));
}

/// Effects beside which the errors were measured anew.
void say_beside(const Run& run, const Findings& found) {
  const auto beside = found.errors_beside();
  if (!beside.empty())
    run.say("  errors of mesh and body measured again beside " + joined(beside, " and ") + ", for all that holds it");
}

/// What was expected of the body and turned out otherwise. Where something is missing it may have stood in for that.
void say_unexpected(const Run& run, const Findings& found) {
  if (found.diagnosis.verdict == Verdict::missing || found.diagnosis.verdict == Verdict::ambiguous) return;
  std::vector<std::string> words;
  for (const auto& far : diagnosis::far_nuisances(found.base.nuisances)) words.push_back(far.in_words);
  if (!words.empty()) run.say("  otherwise than expected, " + joined(words, "; "));
}

constexpr double worth_naming = 0.01;

void say_hypotheses(const Run& run, const Findings& found) {
  constexpr double worth_a_line = 0.01;
  for (const auto& [one, left] : found.told()) {
    if (one->probability < worth_a_line && !one->effects.empty()) continue;
    std::vector<std::string> names;
    for (const int effect : one->effects) names.push_back(found.candidates[static_cast<std::size_t>(effect)].effect);
    const Refit* refit = names.empty() ? nullptr : found.refit_of(names);
    const char* none =
        found.unlisted.probability < diagnosis::worth_telling ? "nothing missing" : "nothing that is listed";
    run.say(fmt::format("  {:<34}{:>6.2f}      unexplained {:.1f} mm [{:.1f}, {:.1f}]     {}",
                        names.empty() ? none : joined(names, " + "), one->probability, left.mean_mm, left.low_mm,
                        left.high_mm, refit ? values_of(refit->parameters) : ""));
  }
}

/// Whether a local cause that no effect lists is likelier than it was before, and where.
void say_unlisted(const Run& run, const Findings& found) {
  const diagnosis::Unlisted& u = found.unlisted;
  if (u.probability < diagnosis::worth_telling) return;
  const std::string place = fmt::format("about ({:.0f}, {:.0f}, {:.0f}) mm (to {:.0f} mm)", u.place_mm.x(),
                                        u.place_mm.y(), u.place_mm.z(), std::max(1.0, u.within_mm));
  const std::string size = u.kind == diagnosis::LocalKind::muscle
                               ? fmt::format("lies {:+.1f} mm [{:+.1f}, {:+.1f}] outward", u.size, u.low, u.high)
                               : fmt::format("is {:.2g} times [{:.2g}, {:.2g}] as stiff", std::exp(u.size),
                                             std::exp(u.low), std::exp(u.high));
  run.say(fmt::format("  {:<34}{:>6.2f}      the {} {} {}", "something local that is not listed", u.probability,
                      diagnosis::local_kind_name(u.kind), place, size));
}

/// How the local cause is put into a model.
void say_how_to_add(const Run& run, const simulation::EffectSetting& effect) {
  std::string numbers;
  for (const auto& [name, value] : effect.options) numbers += fmt::format(" --with {}={}", name, value);
  for (const auto& [name, number] : effect.parameters) numbers += fmt::format(" --with {}={:.3g}", name, number.value);
  run.say(fmt::format("  try it:   supine-model add {} model.toml{} && make CASE=... calibrate", effect.name, numbers));
}

std::string where(const std::vector<diagnosis::HotSpot>& spots) {
  constexpr std::size_t most = 4;
  std::string text;
  for (std::size_t s = 0; s < std::min(most, spots.size()); ++s)
    text += fmt::format("{}{} {:+.1f} mm ({:.0f} cm²)", s > 0 ? ", " : "", spots[s].area, spots[s].mean_signed_mm,
                        spots[s].area_cm2);
  return text.empty() ? "nowhere by more than noise" : text;
}

/// "ligament (0.98) and adhesion (0.96)".
std::string with_probabilities(const Findings& found) {
  std::vector<std::string> named;
  for (const std::string& name : found.diagnosis.missing)
    named.push_back(fmt::format("{} ({:.2f})", name, found.included_of(name).probability));
  return joined(named, found.diagnosis.verdict == Verdict::missing ? " and " : " or ");
}

void say_verdict(const Run& run, const Findings& found) {
  const diagnosis::Diagnosis& d = found.diagnosis;
  const diagnosis::Unexplained& left = found.unexplained;
  switch (d.verdict) {
    case Verdict::nothing_missing:
      run.say(fmt::format("  nothing missing: {}", d.why));
      break;
    case Verdict::missing:
      run.say(fmt::format("  missing:  {}{}", with_probabilities(found),
                          left.low_mm > found.priors.unexplained_bound_mm
                              ? fmt::format(", and {:.1f} mm that no effect here explains", left.mean_mm)
                              : ""));
      break;
    case Verdict::ambiguous:
      run.say(fmt::format("  {}, cannot be told{}: {}; {}",
                          found.hypotheses.front().effects.empty() ? "may be missing" : "missing",
                          d.missing.size() > 1 ? " apart" : "", with_probabilities(found), d.why));
      break;
    case Verdict::unexplained:
      run.say(fmt::format("  unexplained: {}{}", d.why,
                          d.missing.empty() || found.included_of(d.missing[0]).probability < worth_naming
                              ? ""
                              : "; best of the catalogue: " + with_probabilities(found)));
      if (found.forces)
        run.say(
            fmt::format("  hint:     forces on the skin that would explain it reach {:.2f} kPa, {:.2f} by chance; "
                        "missing_force_kpa in diagnosis.vtp",
                        found.forces->force_kpa.rowwise().norm().maxCoeff(), found.forces->threshold_kpa));
  }
}

/// Of what the verdict names: its numbers, where several sets hold it.
void say_numbers(const Run& run, const Findings& found) {
  std::vector<std::string> named = found.diagnosis.missing;
  named.insert(named.end(), found.diagnosis.ambiguous_rest.begin(), found.diagnosis.ambiguous_rest.end());
  for (const std::string& name : named)
    if (const auto numbers = diagnosis::over_sets(found, name); !numbers.empty())
      run.say(fmt::format("  {}, whichever set holds it: {}", name, values_of(numbers)));
}

/// Names with their probabilities: "ligament 0.82 or adhesion 0.31".
std::string with_probabilities(const diagnosis::OtherPrior& other) {
  std::vector<std::string> words;
  for (const std::string& name : other.diagnosis.missing) {
    const auto one = std::find_if(other.included.begin(), other.included.end(),
                                  [&name](const diagnosis::Inclusion& i) { return i.effect == name; });
    words.push_back(one == other.included.end() ? name : fmt::format("{} {:.2f}", name, one->probability));
  }
  return joined(words, other.diagnosis.verdict == Verdict::missing ? " and " : " or ");
}

/// What the verdict would be where another prior, or less trust in the scans, changes it.
void say_other_priors(const Run& run, const Findings& found) {
  for (const diagnosis::OtherPrior& other : found.under_other_priors) {
    const diagnosis::Diagnosis& d = other.diagnosis;
    if (d.verdict == found.diagnosis.verdict && d.missing == found.diagnosis.missing) continue;
    run.say(fmt::format("  with {}{}: {}{}", other.what, other.of_prior ? " in the prior" : "",
                        diagnosis::verdict_name(d.verdict), d.missing.empty() ? "" : " " + with_probabilities(other)));
  }
}

/// "breast.young_modulus_kpa 130 for 112 kPa, part_stiffness.log_ratio -0.4 for 0".
std::string made_up_in_words(const diagnosis::StandIn& stand_in) {
  std::vector<std::string> words;
  for (const diagnosis::MadeUp& number : stand_in.made_up)
    words.push_back(fmt::format("{} {:.3g} for {:.3g}{}", number.name, number.to, number.from,
                                number.unit == "1" ? "" : " " + number.unit));
  return joined(words, ", ");
}

/// "creep (x 3.1)": how many times its usual size would be named every other time.
std::string with_size(const Findings& found, const std::string& effect) {
  for (const diagnosis::Score& score : found.table.scores) {
    if (score.effect != effect) continue;
    if (const double size = diagnosis::size_named(found, score, 0.5); size < 100)
      return fmt::format("{} (x {:.2g})", effect, size);
  }
  return effect;
}

void say_limits(const Run& run, const DiagnosisResult& result) {
  const Findings& found = *result.found;
  std::vector<std::string> blind = diagnosis::not_seen(found);
  blind.insert(blind.end(), found.unseen.begin(), found.unseen.end());
  const auto& set = found.diagnosis.missing;
  if (!found.diagnosis.ambiguous_rest.empty())
    run.say((found.diagnosis.verdict == Verdict::missing ? "  and perhaps: "
                                                         : "  expected, looked for, and not excluded: ") +
            joined(found.diagnosis.ambiguous_rest, " or "));
  std::vector<std::string> sized;
  for (const std::string& effect : blind) sized.push_back(with_size(found, effect));
  run.say("  could not be seen with this scan" +
          (blind.empty() ? ": none" : " (x: of the usual size, named every other time): " + joined(sized, ", ")));
  for (const diagnosis::Candidate& candidate : found.candidates)
    if (candidate.stand_in && std::find(blind.begin(), blind.end(), candidate.effect) != blind.end() &&
        found.priors.is_expected(candidate.effect))
      run.say(fmt::format("    {} of its usual size is made up for by {}", candidate.effect,
                          made_up_in_words(*candidate.stand_in)));
  if (!result.next.empty()) {
    const auto& best = result.next.front();
    std::string text = "  next measurement: " + best.measurement;
    if (set.size() > 1 && best.separation > 0)
      text += fmt::format(" would separate {} by {:.0f} (9 is enough)", best.closest_pair, best.separation);
    if (!best.shows.empty()) text += fmt::format("; shows {} best of what cannot be seen now", best.shows);
    run.say(text);
  }
  if (result.finer_triangles > 0)
    run.say(fmt::format(
        "  finer mesh: this one errs by {:.1f} mm, more than the scan or anything else; make CASE=... TRIANGLES={} "
        "diagnose takes several times as long and may show more",
        found.budget.numerical, result.finer_triangles));
  if (found.diagnosis.verdict == Verdict::missing)
    run.say(fmt::format("  add it:   supine-model add {} model.toml && make CASE=... calibrate", set[0]));
  if (found.unlisted.effect &&
      (found.diagnosis.verdict == Verdict::unexplained || found.unlisted.probability >= diagnosis::worth_telling))
    say_how_to_add(run, *found.unlisted.effect);
}

}  // namespace

void say_diagnosis(const Run& run, const DiagnosisResult& result) {
  const Findings& found = *result.found;
  const auto& b = found.budget;
  say_places(run, found);
  say_creases(run, found);
  say_beside(run, found);
  say_unexpected(run, found);
  say_hypotheses(run, found);
  say_unlisted(run, found);
  run.say(
      fmt::format("  residual: MAE {:.2f} mm, RMS {:.2f}, held-out {:.2f}; scan noise {:.2f}, registration {:.2f}, "
                  "numerical {:.2f}, parameters {:.2f}, patchiness {:.2f}, unexplained {:.2f}",
                  found.base.fit.residuals.skin_mm().cwiseAbs().mean(), b.total, found.held_out_rms_mm, b.noise,
                  b.registration, b.numerical, b.parameters, b.patchiness, b.model_form));
  run.say("  where:    " + where(result.hot_spots));
  say_verdict(run, found);
  say_numbers(run, found);
  say_other_priors(run, found);
  say_limits(run, result);
}

}  // namespace supine::pipeline
