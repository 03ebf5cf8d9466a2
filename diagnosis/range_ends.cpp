// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/range_ends.h"

#include <algorithm>

#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

bool of_measurement(const std::string& name) {
  const std::string effect = name.substr(0, name.find('.'));
  return simulation::find_effect(effect) != nullptr &&
         simulation::traits_of(effect).kind == simulation::EffectKind::measurement;
}

void add_those_of_model(const Findings& found, std::vector<MeasurementAtEnd>& list) {
  const calibration::FreeParameters& p = *found.base.parameters;
  const Eigen::VectorXd& u = found.base.fit.u;
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const std::string& name = p.names()[static_cast<std::size_t>(i)];
    const RangeEnd end = of_measurement(name) ? range_end(p, u, i) : RangeEnd::none;
    if (end == RangeEnd::none) continue;
    list.push_back(
        {name, p.unit(i), p.value(i, u[i]), p.value(i, end == RangeEnd::upper ? p.upper()[i] : p.lower()[i])});
  }
}

void add_those_of_refit(const Refit& refit, std::vector<MeasurementAtEnd>& list) {
  for (const FittedParameter& p : refit.parameters) {
    if (!of_measurement(p.name) || p.end == RangeEnd::none) continue;
    const simulation::Parameter& row = *simulation::find_parameter(p.name);
    list.push_back({p.name, p.unit, p.value, p.end == RangeEnd::upper ? row.upper : row.lower});
  }
}

}  // namespace

std::vector<MeasurementAtEnd> measurements_at_end(const Findings& found) {
  std::vector<MeasurementAtEnd> list;
  add_those_of_model(found, list);
  constexpr double as_likely_as_not = 0.5;
  if (found.diagnosis.verdict == Verdict::nothing_missing || found.unlisted.probability >= as_likely_as_not)
    return list;
  std::vector<std::string> likeliest;
  for (const int effect : found.hypotheses.front().effects)
    likeliest.push_back(found.candidates[static_cast<std::size_t>(effect)].effect);
  if (const Refit* refit = found.refit_of(likeliest)) add_those_of_refit(*refit, list);
  return list;
}

}  // namespace supine::diagnosis
