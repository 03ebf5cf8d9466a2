// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/never_known.h"

#include <map>

#include "diagnosis/evidence/nuisances.h"

namespace supine::diagnosis {

NeverKnown never_known_at(calibration::Evaluator& evaluator, const simulation::Model& model,
                          const calibration::Fit& fit, const Priors& priors) {
  const simulation::Sensitivities sensitivities(evaluator.chain(), model, fit.prediction.solution);
  std::vector<Nuisance> nuisances = nuisances_of(model, poses_of(evaluator.scene()), priors);
  find_shapes(evaluator, sensitivities, model, fit.prediction, fit.residuals, nuisances);
  NeverKnown all;
  all.shapes_mm.resize(fit.residuals.size(), static_cast<Eigen::Index>(nuisances.size()));
  for (std::size_t k = 0; k < nuisances.size(); ++k) {
    all.sources.push_back(nuisances[k].source);
    all.shapes_mm.col(static_cast<Eigen::Index>(k)) = nuisances[k].shape_mm;
  }
  return all;
}

std::string words_of_source(const std::string& source) {
  static const std::map<std::string, std::string> words = {
      {"registration", "where the scan lies"},    {"gravity", "which way is down"},
      {"chest_wall", "how far breath has moved"}, {"segmentation", "where the imaged skin lies"},
      {"gland", "how stiff gland is over fat"},   {"springs", "how firmly the breast is held"},
      {"numerical", "how far tissue compresses"},
  };
  const auto known = words.find(source);
  return known == words.end() ? source : known->second;
}

}  // namespace supine::diagnosis
