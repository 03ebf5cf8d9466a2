// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_budget.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/rms.h"
#include "diagnosis/examine.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

/// Of some of the numbers of a hypothesis: root of the mean variance they leave over the clusters.
template <class Wanted>
double doubt_of(const Hypothesis& h, Wanted wanted) {
  const Directions& all = h.evidence->directions();
  std::vector<int> places, rows;
  for (std::size_t k = 0; k < h.rows.size(); ++k)
    if (wanted(all.names[static_cast<std::size_t>(h.rows[k])]))
      places.push_back(static_cast<int>(k)), rows.push_back(h.rows[k]);
  if (rows.empty()) return 0;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), rows.size());
  for (std::size_t b = 0; b < h.weighed.covariance.size(); ++b)
    covariance += h.weighed.size_probability[static_cast<Eigen::Index>(b)] * h.weighed.covariance[b](places, places);
  const Eigen::MatrixXd columns = all.columns(Eigen::all, rows);
  return std::sqrt((columns * covariance).cwiseProduct(columns).sum() / static_cast<double>(columns.rows()));
}

/// Directions that stand for how and where was measured: scans, imaged skin, gravity, breath.
std::set<std::string> of_measurement(const BaseFit& base) {
  std::set<std::string> names;
  for (const Nuisance& nuisance : base.nuisances)
    if (!nuisance.pose.empty() || simulation::traits_of(nuisance.effect).kind == simulation::EffectKind::measurement)
      names.insert(nuisance.name());
  return names;
}

}  // namespace

ErrorBudget error_budget(const Findings& found) {
  const Hypothesis& h = found.hypotheses.front();
  const std::set<std::string> measured = of_measurement(found.base);
  ErrorBudget budget;
  budget.total = found.rms_mm;
  budget.noise = rms(found.base.noise_of_point_mm.head(found.base.fit.residuals.skin_rows()));
  budget.registration = doubt_of(h, [&](const std::string& name) { return measured.contains(name); });
  budget.parameters = doubt_of(h, [&](const std::string& name) { return !measured.contains(name); });
  if (found.base.numerical) budget.numerical = found.base.numerical->spread_mm;
  budget.patchiness = found.base.patchiness_mm;
  budget.model_form = found.unexplained.mean_mm;
  return budget;
}

bool mesh_errs_most(const ErrorBudget& budget) {
  return budget.numerical >
         std::max({budget.noise, budget.registration, budget.parameters, budget.patchiness, budget.model_form});
}

}  // namespace supine::diagnosis
