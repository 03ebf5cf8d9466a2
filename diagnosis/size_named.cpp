// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/size_named.h"

#include <algorithm>
#include <cmath>

namespace supine::diagnosis {

double size_named(const Findings& found, const Score& score, double share) {
  const std::vector<std::string> effects = found.effects();
  const int effect = static_cast<int>(std::find(effects.begin(), effects.end(), score.effect) - effects.begin());
  const Priors& priors = found.priors;
  const double ln_odds_before = priors.ln_of_set(effects, {effect}) - priors.ln_of_set(effects, {});
  const double ln_odds_named = std::log(priors.named_at / (1 - priors.named_at));
  return size_that_reaches(ln_odds_named - ln_odds_before, share, score.noncentrality, score.freedom);
}

}  // namespace supine::diagnosis
