// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/statistics.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

/// Share of what skin left out has above the noise that the refit takes away, in squares.
double fall_of_skin(double held_out_mm, const BaseFigures& base) {
  const double noise = base.noise_mm * base.noise_mm, before = std::pow(base.held_out_rms_mm, 2);
  return (before - std::pow(held_out_mm, 2)) / std::max(before - noise, 0.01 * noise);
}

bool improves(double held_out_mm, const BaseFigures& base, const VerdictRules& rules) {
  const double fall = base.held_out_rms_mm - held_out_mm;
  if (fall >= rules.held_out_mm && fall >= rules.held_out_share * base.held_out_rms_mm) return true;
  return base.held_out_rms_mm > base.noise_mm && fall_of_skin(held_out_mm, base) >= rules.excess_share;
}

double p_of_effect(const ScoreTable& table, const std::string& effect) {
  for (const Score& score : table.scores)
    if (score.effect == effect) return score.p_value;
  return 1;
}

double p_of(const ScoreTable& table) {
  double p = 1;
  for (const Score& score : table.scores) p = std::min(p, score.p_value);
  return p;
}

/// How many poses that are not fitted judge the refit.
std::size_t unfitted_judges(const Refit& refit, const BaseFigures& base) {
  const bool seen = refit.pose_rms_mm.size() == base.pose_rms_mm.size();
  return seen && unfitted_scans_judge(refit, base.unfitted_poses) ? base.unfitted_poses : 0;
}

/// Share of what some of the poses predicted without themselves have above the noise that the refit takes away, in
/// squares; none without such a pose.
std::optional<double> fall(const Refit& refit, const BaseFigures& base, std::size_t first, std::size_t end) {
  if (refit.pose_rms_mm.size() != base.pose_rms_mm.size() || end <= first) return {};
  const bool each = base.pose_noise_mm.size() == base.pose_rms_mm.size();
  double before = 0, after = 0, noise = 0;
  for (std::size_t i = first; i < end; ++i) {
    before += std::pow(base.pose_rms_mm[i], 2), after += std::pow(refit.pose_rms_mm[i], 2);
    noise += std::pow(each ? base.pose_noise_mm[i] : base.noise_mm, 2);
  }
  return (before - after) / std::max(before - noise, 0.01 * noise);
}

std::optional<double> fall_of_left_out(const Refit& refit, const BaseFigures& base) {
  return fall(refit, base, base.unfitted_poses, base.pose_rms_mm.size());
}

/// The least of what skin left out and poses that were not fitted lose of what they have above the noise, and which.
struct LeastFall {
  double share;
  std::string where;
};

LeastFall least_fall(const Refit& refit, const BaseFigures& base) {
  const double skin = fall_of_skin(refit.held_out_rms_mm, base);
  const double poses = fall(refit, base, 0, unfitted_judges(refit, base)).value_or(1);
  if (poses < skin) return {poses, "scans that were not fitted"};
  return {skin, "blocks of skin left out"};
}

/// What poses that were not fitted say for or against it: their gain, and nothing for it where they are off by more
/// with it (then it is for the small that a larger error is forgiven); for it no more than twice what the fitted one
/// says, because less is known of their errors.
double say_of_unfitted(const Refit& refit, const BaseFigures& base) {
  const std::size_t judges = unfitted_judges(refit, base);
  if (judges == 0) return 0;
  const bool further_off = fall(refit, base, 0, judges).value_or(0) <= 0;
  return std::min(refit.pose_gain, further_off ? 0.0 : 2 * std::max(refit.bic, 0.0));
}

/// b with it.
double evidence(const Refit& refit, const BaseFigures& base) { return refit.bic + say_of_unfitted(refit, base); }

/// Whether poses predicted without themselves bear it out, where there are any. Where it has no equilibrium there they
/// do not.
bool is_borne_out(const Refit& refit, const BaseFigures& base, const VerdictRules& rules) {
  const bool unseen = refit.pose_rms_mm.size() != base.pose_rms_mm.size();
  const bool denied = unseen || say_of_unfitted(refit, base) < -rules.pose_bic;
  if (denied && evidence(refit, base) < rules.strong_bic) return false;
  const double share = refit.bic < rules.bic ? rules.weak_excess_share : rules.pose_excess_share;
  return fall_of_left_out(refit, base).value_or(1) >= share;
}

/// Whether the refit stands out from the model as it is (b = 0), at a place and width it may have, and what was not
/// fitted shows it: blocks of skin, or where its own p is proof enough, because blocks cannot show what lies under one
/// of them alone, another pose. Blocks and another pose together are as good as such a p.
bool counts(const Refit& refit, const ScoreTable& table, const BaseFigures& base, const VerdictRules& rules) {
  if (!refit.finished || refit.at_border || !is_borne_out(refit, base, rules)) return false;
  const double p = p_of_effect(table, refit.effect);
  const bool sure = p <= rules.sure_p, skin = improves(refit.held_out_rms_mm, base, rules);
  const bool enough = evidence(refit, base) >= rules.bic;
  if (refit.bic >= rules.bic && enough && (skin || sure || say_of_unfitted(refit, base) >= rules.bic)) return true;
  if (refit.bic < rules.pose_bic) return false;
  const bool pose = fall(refit, base, 0, unfitted_judges(refit, base)).value_or(0) >= rules.weak_excess_share;
  if (sure) return fall_of_left_out(refit, base).has_value() || pose || enough;
  return p < rules.p_value && skin && pose && enough;
}

/// Whether the fitted skin, skin left out and a pose that was not fitted all show it: then it needs no p. A score has
/// to get past the tolerance for its own effect, which hides most of an effect that errors may imitate.
bool is_shown_by_all(const Refit& refit, const BaseFigures& base, const VerdictRules& rules) {
  return refit.bic >= rules.bic && say_of_unfitted(refit, base) >= rules.bic &&
         improves(refit.held_out_rms_mm, base, rules);
}

bool comes_near(const Refit& refit, const Refit& best, double misfit, const BaseFigures& base,
                const VerdictRules& rules) {
  return evidence(best, base) - evidence(refit, base) < rules.bic * std::max(1.0, misfit);
}

/// The best of what counts, and what comes near it whether it would count by itself or not.
std::vector<const Refit*> best_and_rivals(const ScoreTable& table, const std::vector<Refit>& refits,
                                          const std::vector<LackOfFit>& left, const BaseFigures& base,
                                          const VerdictRules& rules) {
  const Refit* best = nullptr;
  for (const Refit& refit : refits)
    if (counts(refit, table, base, rules) && (best == nullptr || evidence(refit, base) > evidence(*best, base)))
      best = &refit;
  if (best == nullptr) return {};
  std::vector<const Refit*> good = {best};
  const double misfit = left[static_cast<std::size_t>(best - refits.data())].misfit;
  for (const Refit& refit : refits)
    if (&refit != best && refit.finished && refit.bic > 0 && comes_near(refit, *best, misfit, base, rules))
      good.push_back(&refit);
  return good;
}

bool is_real(const LackOfFit& left, const VerdictRules& rules) {
  return left.p_value < rules.lack_of_fit_p && left.misfit > rules.lack_of_fit_misfit;
}

/// No refit counts: nothing is missing, or it is none of these.
Diagnosis nothing_counts(double p, const std::vector<Refit>& refits, const BaseFigures& base,
                         const VerdictRules& rules) {
  const Refit* most = nullptr;
  for (const Refit& refit : refits)
    if (refit.finished && (most == nullptr || evidence(refit, base) > evidence(*most, base))) most = &refit;
  Diagnosis result;
  result.left = base.left;
  result.why = "no effect of the catalogue is borne out by what was not fitted";
  if (most != nullptr && most->bic > rules.bic) result.why += fmt::format("; {} fits best (p {:.3f})", most->effect, p);
  const bool strong = most != nullptr && most->bic >= rules.strong_bic;
  if (!is_real(base.left, rules) && !(strong && p < rules.p_value)) return result;
  result.verdict = Verdict::unexplained;
  if (!refits.empty()) result.missing = {most != nullptr ? most->effect : refits.front().effect};
  return result;
}

/// Why the best does not explain what is there; empty where it does.
std::string what_speaks_against(const Refit& best, const LackOfFit& left, const BaseFigures& base,
                                const VerdictRules& rules) {
  const LeastFall taken = least_fall(best, base);
  const bool all_in_order = left.p_value >= rules.lack_of_fit_p || left.misfit < rules.slight_misfit;
  const bool mostly_this = all_in_order || taken.share >= rules.excess_share;
  if (mostly_this && !is_real(left, rules)) return {};
  const std::string leaves = fmt::format(
      "best of the catalogue, but it leaves {:.1f} times what errors would (p {:.2g})", left.misfit, left.p_value);
  if (mostly_this) return leaves;
  if (taken.share <= 0) return leaves + " and does not bring " + taken.where + " nearer";
  return leaves +
         fmt::format(" and takes away {:.0f} % of what {} have above the noise", 100 * taken.share, taken.where);
}

/// Polynomials in q up to degree 6, of the points of one pose each.
Eigen::MatrixXd smooth_shapes(const calibration::Residuals& residuals) {
  constexpr int degree = 6;
  const int poses = residuals.pose.maxCoeff() + 1, each = (degree + 1) * (degree + 2) / 2;
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(residuals.size(), poses * each);
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    int column = residuals.pose[r] * each;
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; a + b <= degree; ++b)
        shapes(r, column++) = std::pow(residuals.q(r, 0), a) * std::pow(residuals.q(r, 1), b);
  }
  return shapes;
}

}  // namespace

std::string verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::nothing_missing:
      return "nothing_missing";
    case Verdict::missing:
      return "missing";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::unexplained:
      return "unexplained";
  }
  return {};
}

LackOfFit lack_of_fit(const WeightedFit& fit, const Metric& metric) {
  const calibration::Fit& f = fit.solution;
  const Eigen::VectorXd white = metric.whitening->apply(f.residuals.distance_mm + metric.mean_mm);
  const Eigen::MatrixXd absorbed = orthonormal_basis(metric.whitening->apply(f.linearisation.slope));
  Eigen::MatrixXd shapes = metric.whitening->apply(smooth_shapes(f.residuals));
  shapes -= absorbed * (absorbed.transpose() * shapes);
  const Eigen::MatrixXd free = orthonormal_basis(shapes);
  LackOfFit left;
  left.misfit = white.squaredNorm() / static_cast<double>(white.size() - absorbed.cols());
  left.p_value = chi_squared_above(static_cast<int>(free.cols()), (free.transpose() * white).squaredNorm());
  return left;
}

Diagnosis decide(const ScoreTable& table, const std::vector<Refit>& refits, const std::vector<LackOfFit>& left,
                 const BaseFigures& base, const VerdictRules& rules) {
  const double p = p_of(table);
  const std::vector<const Refit*> good = best_and_rivals(table, refits, left, base, rules);
  const bool more_than_errors = base.left.p_value < rules.lack_of_fit_p;
  const bool shown = !good.empty() && more_than_errors && is_shown_by_all(*good.front(), base, rules);
  if (p >= rules.p_value && !is_real(base.left, rules) && !shown) {
    Diagnosis result;
    result.left = base.left;
    result.why =
        fmt::format("errors of scan, registration and mesh alone score as high as the best effect (p {:.3f})", p);
    return result;
  }
  if (good.empty()) return nothing_counts(p, refits, base, rules);
  const Refit& best = *good.front();
  Diagnosis result;
  result.left = left[static_cast<std::size_t>(&best - refits.data())];
  result.why = what_speaks_against(best, result.left, base, rules);
  if (!result.why.empty()) {
    result.verdict = Verdict::unexplained;
    result.missing = {best.effect};
    return result;
  }
  for (const Refit* refit : good) result.missing.push_back(refit->effect);
  std::stable_partition(result.missing.begin(), result.missing.end(), simulation::is_measurement_effect);
  result.verdict = result.missing.size() == 1 ? Verdict::missing : Verdict::ambiguous;
  result.why = result.verdict == Verdict::missing ? "no other effect comes near" : "these do equally well";
  if (p >= rules.p_value && shown)
    result.why += fmt::format("; the whole skin, skin left out and another scan show it, its score does not (p {:.3f})",
                              p_of_effect(table, best.effect));
  else if (!improves(best.held_out_rms_mm, base, rules))
    result.why +=
        fmt::format("; named by its p ({:.3f}), the held-out error does not show it", p_of_effect(table, best.effect));
  return result;
}

}  // namespace supine::diagnosis
