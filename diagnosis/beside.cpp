// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/beside.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/log_sum.h"
#include "diagnosis/evidence/other_priors.h"

namespace supine::diagnosis {
namespace {

constexpr double likelier_than_not = 0.5;

/// ln of what speaks for sets without an effect, up to what is the same for all.
double doubt(const std::vector<Hypothesis>& hypotheses, int effect) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : hypotheses)
    if (!is_part_of({effect}, h.effects)) most = std::max(most, ln_weight(h));
  return most;
}

bool is_sure_by_half(const Findings& found, int effect) {
  return inclusion(half_believed(found.hypotheses, found.priors), effect) >= found.priors.named_at;
}

}  // namespace

std::vector<int> surest_part(const Findings& found) {
  const std::vector<Hypothesis>& all = found.hypotheses;
  std::vector<int> part;
  if (!found.beside.empty() && is_part_of(found.beside.back().effects, all.front().effects))
    part = found.beside.back().effects;
  int next = -1;
  for (const int e : all.front().effects)
    if (!is_part_of({e}, part) && (next < 0 || doubt(all, e) < doubt(all, next))) next = e;
  if (next < 0 || inclusion(all, next) < found.priors.named_at) return {};
  part.insert(std::upper_bound(part.begin(), part.end(), next), next);
  if (std::any_of(found.beside.begin(), found.beside.end(),
                  [&part](const Findings::Beside& beside) { return beside.effects == part; }))
    return {};
  double more = 0;
  for (const Hypothesis& h : all)
    if (is_part_of(part, h.effects) && h.effects.size() > part.size()) more += h.probability;
  const bool doubtful = part.size() == 1 && !is_sure_by_half(found, next);
  return more > likelier_than_not || doubtful ? part : std::vector<int>{};
}

double ln_odds_of(const std::vector<Hypothesis>& hypotheses, const std::vector<int>& part) {
  std::vector<double> with, without;
  for (const Hypothesis& h : hypotheses) (is_part_of(part, h.effects) ? with : without).push_back(ln_weight(h));
  const auto sum = [](const std::vector<double>& logs) {
    return log_sum(Eigen::Map<const Eigen::VectorXd>(logs.data(), static_cast<Eigen::Index>(logs.size())));
  };
  return sum(with) - sum(without);
}

void keep_odds(Findings& found) {
  if (found.beside.empty()) return;
  const Findings::Beside& last = found.beside.back();
  last.ground->ln_weight += last.ln_odds - ln_odds_of(found.hypotheses, last.effects);
}

}  // namespace supine::diagnosis
