// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "diagnosis/chi_squared.h"

namespace supine::diagnosis {
namespace {

bool improves(double held_out_mm, const BaseFigures& base, const VerdictRules& rules) {
  const double fall = base.held_out_rms_mm - held_out_mm;
  if (fall >= rules.held_out_mm && fall >= rules.held_out_share * base.held_out_rms_mm) return true;
  const double noise = base.noise_mm * base.noise_mm, before = std::pow(base.held_out_rms_mm, 2) - noise;
  return before > 0 && std::pow(held_out_mm, 2) - noise <= (1 - rules.excess_share) * before;
}

/// Over poses predicted without themselves.
double pose_rms(const std::vector<double>& poses) {
  double sum = 0;
  for (const double p : poses) sum += p * p;
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

bool comes_near(const Refit& refit, const Refit& best, double misfit, const VerdictRules& rules) {
  const bool near = best.bic - refit.bic < rules.bic * std::max(1.0, misfit);
  if (refit.pose_rms_mm.empty() || refit.pose_rms_mm.size() != best.pose_rms_mm.size()) return near;
  const double own = pose_rms(refit.pose_rms_mm), its = pose_rms(best.pose_rms_mm);
  // A pose predicted without itself judges both: it can tell apart what the fitted one cannot, and bring back what
  // the fitted one had put aside too surely.
  return near ? own < (1 + rules.pose_share) * its : own < its;
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

/// Share of what poses predicted without themselves have above the noise that the refit takes away, in squares; none
/// without such a pose. A scan that lies elsewhere says nothing of where one that was not fitted lies.
std::optional<double> pose_fall(const Refit& refit, const BaseFigures& base) {
  const std::size_t silent = refit.effect == "misregistration" ? base.unfitted_poses : 0;
  if (refit.pose_rms_mm.size() != base.pose_rms_mm.size() || base.pose_rms_mm.size() <= silent) return {};
  const auto rms_of = [silent](const std::vector<double>& poses) {
    return pose_rms({poses.begin() + static_cast<std::ptrdiff_t>(silent), poses.end()});
  };
  const double noise = base.noise_mm * base.noise_mm, before = std::pow(rms_of(base.pose_rms_mm), 2) - noise;
  const double after = std::pow(rms_of(refit.pose_rms_mm), 2) - noise;
  return (before - after) / std::max(before, 0.01 * noise);
}

/// Whether the p of the effect is proof enough: held-out blocks of skin cannot show what lies under one block alone.
bool is_sure(const Refit& refit, const ScoreTable& table, const BaseFigures& base, const VerdictRules& rules) {
  if (p_of_effect(table, refit.effect) > rules.sure_p) return false;
  const std::optional<double> fall = pose_fall(refit, base);
  if (!fall) return refit.bic >= rules.bic;
  return refit.bic >= rules.pose_bic &&
         *fall >= (refit.bic < rules.bic ? rules.weak_excess_share : rules.pose_excess_share);
}

/// Whether skin that was not fitted shows it: blocks of the fitted scan, and another pose where there is one.
bool is_confirmed(const Refit& refit, const BaseFigures& base, const VerdictRules& rules) {
  return refit.bic >= rules.bic && improves(refit.held_out_rms_mm, base, rules) &&
         pose_fall(refit, base).value_or(1) >= rules.pose_excess_share;
}

/// What counts, best first, and what comes near the best of it whether it would count by itself or not.
std::vector<const Refit*> counting(const ScoreTable& table, const std::vector<Refit>& refits,
                                   const std::vector<LackOfFit>& left, const BaseFigures& base,
                                   const VerdictRules& rules) {
  const auto counts = [&](const Refit& refit) {
    // The model as it is has b = 0: what does not stand out from that either is not named.
    return refit.finished && (is_confirmed(refit, base, rules) || is_sure(refit, table, base, rules));
  };
  std::vector<const Refit*> good;
  const Refit* best = nullptr;
  double misfit = 1;
  for (std::size_t r = 0; r < refits.size(); ++r) {
    const Refit& refit = refits[r];
    if (best == nullptr && counts(refit)) best = &refit, misfit = left[r].misfit;
    const bool near = best != nullptr && refit.finished && refit.bic > 0 && comes_near(refit, *best, misfit, rules);
    if (&refit == best || (best != nullptr && counts(refit)) || near) good.push_back(&refit);
  }
  return good;
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

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  if (columns.cols() == 0) return columns;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
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

bool is_measurement_effect(const std::string& effect) {
  return effect == "misregistration" || effect == "gravity_tilt" || effect == "segmentation_offset" ||
         effect == "incompressibility";
}

LackOfFit lack_of_fit(const WeightedFit& fit, const Metric& metric) {
  const calibration::Fit& f = fit.fit;
  const Eigen::VectorXd white = metric.whitening->apply(f.residuals.distance_mm + metric.mean_mm);
  const Eigen::MatrixXd absorbed = orthonormal(metric.whitening->apply(f.linearisation.slope));
  Eigen::MatrixXd shapes = metric.whitening->apply(smooth_shapes(f.residuals));
  shapes -= absorbed * (absorbed.transpose() * shapes);
  const Eigen::MatrixXd free = orthonormal(shapes);
  LackOfFit left;
  left.misfit = white.squaredNorm() / static_cast<double>(white.size() - absorbed.cols());
  left.p_value = chi_squared_above(static_cast<int>(free.cols()), (free.transpose() * white).squaredNorm());
  return left;
}

Diagnosis decide(const ScoreTable& table, const std::vector<Refit>& refits, const std::vector<LackOfFit>& left,
                 const BaseFigures& base, const VerdictRules& rules) {
  Diagnosis result;
  result.left = base.left;
  const auto real = [&rules](const LackOfFit& l) {
    return l.p_value < rules.lack_of_fit_p && l.misfit > rules.lack_of_fit_misfit;
  };
  const double p = p_of(table);
  if (p >= rules.p_value && !real(base.left)) {
    result.why =
        fmt::format("errors of scan, registration and mesh alone score as high as the best effect (p {:.3f})", p);
    return result;
  }
  const std::vector<const Refit*> good = counting(table, refits, left, base, rules);
  if (good.empty()) {
    result.why = "no effect of the catalogue lowers the held-out error";
    if (!refits.empty() && refits.front().finished && refits.front().bic > rules.bic)
      result.why += fmt::format("; {} fits best (p {:.3f}) but is not confirmed", refits.front().effect, p);
    const bool strong = !refits.empty() && refits.front().finished && refits.front().bic >= rules.strong_bic;
    if (!real(base.left) && !(strong && p < rules.p_value)) return result;
    result.verdict = Verdict::unexplained;
    if (!refits.empty()) result.missing = {refits.front().effect};
    return result;
  }
  const Refit& best = *good.front();
  result.left = left[static_cast<std::size_t>(&best - refits.data())];
  for (const Refit* refit : good)
    if (refit == &best || comes_near(*refit, best, result.left.misfit, rules)) result.missing.push_back(refit->effect);
  const double fall = base.unfitted_poses > 0 ? pose_fall(best, base).value_or(1) : 1;
  const bool elsewhere_too = fall >= rules.excess_share || result.left.p_value >= rules.lack_of_fit_p;
  if (real(result.left) || !elsewhere_too) {
    result.verdict = Verdict::unexplained;
    result.missing = {best.effect};
    result.why = fmt::format("best of the catalogue, but it leaves {:.1f} times what errors would (p {:.2g})",
                             result.left.misfit, result.left.p_value);
    if (!elsewhere_too)
      result.why +=
          fmt::format(" and takes away {:.0f} % of what scans that were not fitted have above noise", 100 * fall);
    return result;
  }
  std::stable_partition(result.missing.begin(), result.missing.end(), is_measurement_effect);
  result.verdict = result.missing.size() == 1 ? Verdict::missing : Verdict::ambiguous;
  result.why = result.verdict == Verdict::missing ? "no other effect comes near" : "these do equally well";
  if (!improves(best.held_out_rms_mm, base, rules))
    result.why +=
        fmt::format("; named by its p ({:.3f}), the held-out error does not show it", p_of_effect(table, best.effect));
  return result;
}

}  // namespace supine::diagnosis
