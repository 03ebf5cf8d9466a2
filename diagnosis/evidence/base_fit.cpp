// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/base_fit.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "calibration/noise.h"
#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/side_by_side.h"
#include "diagnosis/creases.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/evidence/field_modes.h"
#include "diagnosis/evidence/mean_kernel.h"
#include "diagnosis/evidence/mesh_doubt.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::Evaluator;
using calibration::FreeParameters;
using calibration::Residuals;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index most_clusters = 600;
constexpr int most_steps = 6;
constexpr int most_rounds = 3;
constexpr double far = 0.2;  // of a coordinate: errors measured there are not those of the body any more

/// The scanner's noise, what is white of it and what neighbours share.
struct ScanNoise {
  VectorXd white_mm, shared_mm;
  VectorXd repeats;  // points that say what one says
};

/// White is what neighbouring points show, where there are enough of them, and no less than the least. Where that is
/// less than the case says, the rest is taken to be shared. Points that repeat each other show nothing: where the case
/// says how many they are worth, white is what it says, and each counts for less. Landmarks err one by one.
/// @param worth  per measurement
ScanNoise noise_of(const Residuals& residuals, const VectorXd& shared_mm,
                   const std::vector<std::optional<double>>& worth) {
  constexpr int fewest = 200;
  ScanNoise noise{residuals.sigma_mm, shared_mm, VectorXd::Ones(residuals.size())};
  for (int pose = 0; pose <= residuals.pose.maxCoeff(); ++pose) {
    std::vector<int> rows;
    for (Index r = 0; r < residuals.size(); ++r)
      if (residuals.pose[r] == pose && !residuals.is_landmark(r)) rows.push_back(static_cast<int>(r));
    if (const auto& independent = worth[static_cast<std::size_t>(pose)]) {
      noise.repeats(rows).setConstant(std::max(1.0, static_cast<double>(rows.size()) / *independent));
      continue;
    }
    if (rows.size() < fewest) continue;
    const double seen =
        calibration::estimate_noise_mm(residuals.on_skin(rows, Eigen::all), residuals.distance_mm(rows));
    for (const int r : rows) {
      const double given = residuals.sigma_mm[r];
      noise.white_mm[r] = std::max(seen, calibration::least_noise_mm);
      noise.shared_mm[r] = std::max(shared_mm[r], std::sqrt(std::max(0.0, given * given - seen * seen)));
    }
  }
  return noise;
}

/// What creases of the model's skin may do.
void add_creases(const CreaseError& creases, BaseFit& base) {
  base.creased_points = creases.points;
  if (creases.points == 0) return;
  const calibration::Clusters& c = base.clusters;
  const VectorXd sd = c.means(creases.sd_mm);
  for (Index i = 0; i < base.errors.rows(); ++i)
    for (Index j = 0; j < base.errors.cols(); ++j)
      if (sd[i] * sd[j] > 0 && c.related(i, j))
        base.errors(i, j) += sd[i] * sd[j] * std::exp(-(c.place.row(i) - c.place.row(j)).norm() / creases.length_mm);
}

/// What scanners err together, and what the mesh does beyond what is taken away.
void add_shared(const BaseFit& base, const Priors& priors, const VectorXd& shared_mm, MatrixXd& errors) {
  const calibration::Clusters& c = base.clusters;
  const MatrixXd scan = gaussian_kernel(c.place, c.place, priors.scan_shared_length_mm);
  VectorXd spread = VectorXd::Zero(c.pose.size());
  if (base.numerical) spread = base.numerical->spread_mm * c.means(base.numerical->share);
  for (Index i = 0; i < errors.rows(); ++i)
    for (Index j = 0; j < errors.cols(); ++j) {
      if (!c.related(i, j)) continue;
      errors(i, j) += shared_mm[i] * shared_mm[j] * scan(i, j);
      if (base.numerical)
        errors(i, j) +=
            spread[i] * spread[j] * std::exp(-(c.place.row(i) - c.place.row(j)).norm() / base.numerical->length_mm);
    }
}

/// What uneven tissue and forces that no catalogue lists move.
void find_body(Evaluator& evaluator, const simulation::Sensitivities& sensitivities, const Priors& priors,
               BaseFit& base) {
  const calibration::Prediction& prediction = base.fit.prediction;
  base.patches = base.clusters.means(
      patchiness_shapes(evaluator.chain(), sensitivities, prediction, base.fit.residuals, priors.patchiness));
  base.local = local_causes(evaluator.chain().mechanics(), priors.patchiness, base.patches);
  base.kernel =
      discrepancy_of(*evaluator.scene().mesh, sensitivities, prediction, base.fit.residuals, base.clusters).kernel;
}

/// Puts together what was measured of body and mesh, and the scans' noise.
void add_up_errors(Evaluator& evaluator, const Priors& priors, BaseFit& base) {
  const Residuals& residuals = base.fit.residuals;
  VectorXd shared_mm(residuals.size());
  const auto& measurements = evaluator.scene().measurements;
  for (Index r = 0; r < shared_mm.size(); ++r)
    shared_mm[r] = residuals.is_landmark(r)
                       ? 0
                       : priors.scan_shared_in(measurements[static_cast<std::size_t>(residuals.pose[r])]->pose.name);
  std::vector<std::optional<double>> worth;
  for (const auto* measurement : measurements) worth.push_back(priors.independent_points_in(measurement->pose.name));
  const ScanNoise noise = noise_of(residuals, shared_mm, worth);
  base.noise_of_point_mm = noise.white_mm;
  base.repeats = noise.repeats;
  const VectorXd variance = base.clusters.means(base.noise_of_point_mm.cwiseAbs2().cwiseProduct(base.repeats));
  base.errors = variance.cwiseQuotient(base.clusters.members).asDiagonal();
  add_shared(base, priors, base.clusters.means(noise.shared_mm), base.errors);
  add_creases(crease_error(evaluator.scene(), base.fit.prediction, residuals), base);
  base.errors += base.patches * base.patches.transpose();
  base.patchiness_mm = std::sqrt(base.patches.squaredNorm() / static_cast<double>(base.patches.rows()));
  base.mean_mm = VectorXd::Zero(residuals.size());
  if (base.numerical) {
    base.mean_mm = base.numerical->finer_mm;
    const VectorXd doubt = base.numerical->finer_doubt * base.clusters.means(base.numerical->finer_mm);
    const VectorXd coarser = base.clusters.means(base.numerical->coarser_mm);
    base.errors += doubt * doubt.transpose() + coarser * coarser.transpose();
  }
  base.scale_mm = std::max(priors.least_unexplained_mm, priors.share_of_way * way_mm(base.fit.prediction.solution));
  base.most_mm = priors.most_unexplained_mm;
  base.covariance = std::make_unique<ErrorCovariance>(base.errors, base.kernel, base.scale_mm, base.most_mm);
}

/// Errors of body and mesh where @p base is.
/// @param meshes  the mesh's errors of a similar model, or at least its other meshes; nullptr = of no model yet
void find_errors(Evaluator& evaluator, JointFitter& fitter, const Priors& priors, bool other_meshes,
                 const NumericalError* meshes, BaseFit& base) {
  const auto sensitivities = fitter.linearise();
  std::optional<NumericalError> numerical;
  std::vector<std::function<void()>> works{[&] { find_body(evaluator, *sensitivities, priors, base); }};
  if (other_meshes)
    works.insert(works.begin(), [&] {
      numerical = measure_numerical_error(evaluator.scene(), base.model, base.fit, meshes,
                                          calibration::most_work_beside(base.dearest));
    });
  side_by_side(works);
  base.numerical = std::move(numerical);
  add_up_errors(evaluator, priors, base);
}

/// Where the discrepancy is of some size, allows for its shapes as the fit leaves them open. @return  whether it did
bool allow_for_shapes(const calibration::MeasuredScene& scene, BaseFit& base) {
  if (base.size_mm < least_size_of_mean_kernel_mm) return false;
  base.kernel = mean_kernel(scene, base);
  base.covariance = std::make_unique<ErrorCovariance>(base.errors, base.kernel, base.scale_mm, base.most_mm);
  return true;
}

/// Parameters stay where they were fitted, and go together as they did.
void allow_for_mesh(const FreeParameters& parameters, const Directions& all, JointPosterior& found) {
  const Index moduli = found.of_parameters.rows();
  VectorXd wider = VectorXd::Ones(moduli);
  for (Index k = 0; k < all.size(); ++k) {
    const std::string& name = all.names[static_cast<std::size_t>(k)];
    const double doubt = mesh_doubt(name.substr(name.find('/') + 1));  // of a nuisance behind its pose
    const double believed = std::abs(all.unit[k]) * all.sd[k];
    if (!(doubt > 0) || !(found.sd[k] > 0)) continue;
    const double sd = found.sd[k];
    if (k >= moduli) {
      const Known known = with_doubt({found.value[k], sd}, {0, believed}, doubt);
      found.value[k] = known.mean, found.sd[k] = known.sd;
    } else if (parameters.is_log(k)) {
      found.sd[k] = with_doubt({0, sd}, {0, believed}, std::abs(all.unit[k]) * doubt).sd;
      wider[k] = found.sd[k] / sd;
    }
  }
  found.of_parameters = wider.asDiagonal() * found.of_parameters * wider.asDiagonal();
}

VectorXd coordinates_of(const FreeParameters& parameters, const simulation::Model& start) {
  VectorXd u = parameters.start();
  simulation::Model from = start;
  for (Index i = 0; i < u.size(); ++i)
    if (const auto* setting = simulation::find_setting(from, parameters.names()[static_cast<std::size_t>(i)]))
      u[i] = parameters.coordinate(i, setting->value);
  return parameters.clamped(u);
}

}  // namespace

Directions directions_at(const calibration::Fit& fit, const FreeParameters& parameters,
                         const std::vector<Nuisance>& nuisances, const calibration::Clusters& clusters) {
  constexpr double open = 3;  // coordinates: nothing is believed of it
  Directions all;
  const MatrixXd slope = clusters.means(fit.linearisation.slope);
  const VectorXd unit = parameters.slope(fit.u);
  for (Index i = 0; i < slope.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto& prior = parameters.priors()[k];
    all.add(parameters.names()[k], slope.col(i), prior ? prior->mean - fit.u[i] : 0, prior ? prior->sd : open,
            parameters.value(i, fit.u[i]), unit[i]);
  }
  for (const Nuisance& nuisance : nuisances)
    all.add(nuisance.name(), clusters.means(nuisance.shape_mm), -nuisance.value, 1, nuisance.value * nuisance.sigma,
            nuisance.sigma);
  return all;
}

LinearEvidence evidence_of(const BaseFit& ground, const JointFit& at) {
  return {*ground.covariance, ground.distances(at.fit.residuals),
          directions_at(at.fit, *at.parameters, at.nuisances, ground.clusters)};
}

JointPosterior posterior_of(const BaseFit& base) {
  const LinearEvidence evidence = evidence_of(base, base);
  const Weighed weighed = evidence.weigh_all();
  const Directions& all = evidence.directions();
  const Index moduli = base.fit.u.size();
  JointPosterior result{all.names, VectorXd(all.size()), VectorXd(all.size()), MatrixXd::Zero(moduli, moduli)};
  VectorXd mean = VectorXd::Zero(moduli);
  for (Index k = 0; k < all.size(); ++k) {
    const auto [offset, sd] = weighed.number(k);
    result.value[k] = all.stands[k] + all.unit[k] * offset;
    result.sd[k] = all.unit[k] * sd;
    if (k < moduli) mean[k] = offset;
  }
  for (std::size_t b = 0; b < weighed.mean.size(); ++b) {
    const VectorXd from = weighed.mean[b].head(moduli) - mean;
    result.of_parameters += weighed.size_probability[static_cast<Index>(b)] *
                            (weighed.covariance[b].topLeftCorner(moduli, moduli) + from * from.transpose());
  }
  if (base.numerical) allow_for_mesh(*base.parameters, all, result);
  return result;
}

VectorXd BaseFit::distances(const Residuals& residuals) const {
  return clusters.means(residuals.distance_mm + mean_mm);
}

double BaseFit::size_of(const Weighed& weighed) const {
  return covariance->sizes_mm()[static_cast<Index>(weighed.likeliest())];
}

BaseFit fit_base_model(Evaluator& evaluator, const simulation::Model& given, const simulation::Model& start,
                       const std::vector<double>& noise_mm, const simulation::ChainSolution* near,
                       const BaseFitOptions& options) {
  const auto tell = [&options](const std::string& what) {
    if (options.progress) options.progress(what);
  };
  BaseFit base;
  base.noise_mm = noise_mm;
  base.keeps_history = options.keeps_history;
  base.parameters.emplace(given);
  JointFitter fitter(evaluator, base, base);
  base.nuisances = nuisances_of(given, fitter.poses(), options.priors);
  fitter.predict({coordinates_of(*base.parameters, start), base.nuisances}, near);
  base.clusters = calibration::cluster_points(base.fit.residuals, most_clusters);
  for (int round = 0; round < most_rounds; ++round) {
    const VectorXd measured_at = base.fit.u;
    tell("errors of mesh and body");
    const std::optional<NumericalError> before = std::move(base.numerical);
    find_errors(evaluator, fitter, options.priors, options.other_meshes, before ? &*before : nullptr, base);
    fitter.descend(most_steps, [&] { tell("fit with all that is never known"); });
    if ((base.fit.u - measured_at).cwiseAbs().maxCoeff() < far) break;
  }
  if (allow_for_shapes(evaluator.scene(), base)) fitter.descend(most_steps);
  return base;
}

std::unique_ptr<BaseFit> ground_beside(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& at,
                                       const Priors& priors) {
  auto ground = std::make_unique<BaseFit>();
  static_cast<JointFit&>(*ground) = at;
  ground->fit.mask = base.fit.mask;
  ground->noise_mm = base.noise_mm;
  ground->dearest = std::max(at.dearest, base.dearest);
  ground->clusters = base.clusters;
  Evaluator evaluator(scene, at.model, accurate_enough());
  NumericalError meshes;  // without solutions: those are of a model that lacks the effects
  if (base.numerical) {
    meshes.coarse = base.numerical->coarse;
    meshes.on_finer.mesh = base.numerical->on_finer.mesh;
    meshes.on_coarser.mesh = base.numerical->on_coarser.mesh;
  }
  JointFitter fitter(evaluator, *ground, *ground);
  find_errors(evaluator, fitter, priors, base.numerical.has_value(), &meshes, *ground);
  allow_for_shapes(scene, *ground);
  return ground;
}

}  // namespace supine::diagnosis
