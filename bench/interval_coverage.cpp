// SPDX-License-Identifier: AGPL-3.0-or-later
//
// How often the 95 % intervals of a calibration hold the truth: at the fit of a case, errors are drawn (noise of single
// points alone, then with an error that neighbouring points share), the parameters are estimated by one linear step,
// the interval is made from what is left, as after any fit, and asked whether it holds the truth. The naive interval
// (every point errs by itself) stands beside it.
//
//   bench_interval_coverage CASE MESH.vtu [DRAWS]
#include <fmt/core.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <random>

#include "calibration/uncertainty.h"
#include "common/error.h"
#include "common/statistics.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_file.h"
#include "reconstruction/surface_io.h"

namespace supine {
namespace {

using calibration::ErrorModel;
using calibration::Fit;

class Coverage {
 public:
  Coverage(const Fit& fit, const calibration::FreeParameters& parameters, const ErrorModel& errors)
      : fit_(fit), parameters_(parameters), errors_(errors), solver_(fit.linearisation.slope) {
    clusters_ = calibration::cluster_points(fit.residuals, 450);
    const Eigen::Index n = clusters_.members.size();
    Eigen::MatrixXd shared(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        shared(i, j) =
            clusters_.pose[i] == clusters_.pose[j]
                ? std::exp(-(clusters_.place.row(i) - clusters_.place.row(j)).norm() / std::max(errors.length_mm, 1.0))
                : 0;
    shared.diagonal().array() += 1e-9;
    root_ = Eigen::LLT<Eigen::MatrixXd>(shared).matrixL();
  }

  void measure(const char* what, double nugget_mm, double spread_mm, int draws) {
    const Eigen::Index parameters = fit_.u.size();
    Eigen::VectorXi honest = Eigen::VectorXi::Zero(parameters), naive = honest;
    for (int draw = 0; draw < draws; ++draw) {
      const Eigen::VectorXd error = drawn(nugget_mm, spread_mm);
      const Eigen::VectorXd step = -solver_.solve(error);
      Fit noisy = fit_;
      noisy.u += step;
      noisy.residuals.distance_mm = error + fit_.linearisation.slope * step;
      const auto worth = calibration::judge(noisy, parameters_, false);
      for (Eigen::Index p = 0; p < parameters; ++p) {
        honest[p] += std::abs(step[p]) < normal_reach95() * std::sqrt(worth.covariance(p, p));
        naive[p] += std::abs(step[p]) < normal_reach95() * std::sqrt(worth.white(p, p));
      }
    }
    for (Eigen::Index p = 0; p < parameters; ++p) {
      const double share = static_cast<double>(honest[p]) / draws;
      fmt::print("| {} | {} | {:.0f} ± {:.0f} % | {:.0f} % |\n", what, parameters_.names()[static_cast<std::size_t>(p)],
                 100 * share, 196 * std::sqrt(share * (1 - share) / draws), 100.0 * naive[p] / draws);
    }
  }

 private:
  Eigen::VectorXd drawn(double nugget_mm, double spread_mm) {
    Eigen::VectorXd shared(root_.rows()), error(fit_.residuals.size());
    for (double& number : shared) number = normal_(generator_);
    shared = spread_mm * (root_ * shared);
    for (Eigen::Index i = 0; i < error.size(); ++i)
      error[i] = nugget_mm * normal_(generator_) + shared[clusters_.of_point[i]];
    return error;
  }

  const Fit& fit_;
  const calibration::FreeParameters& parameters_;
  ErrorModel errors_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver_;
  calibration::Clusters clusters_;
  Eigen::MatrixXd root_;
  std::mt19937_64 generator_{1};
  std::normal_distribution<double> normal_;
};

void run(const std::filesystem::path& folder, const std::filesystem::path& mesh_file, int draws) {
  const pipeline::Case description = pipeline::read_case(folder);
  const simulation::Model model = pipeline::read_model(folder / "model.toml");
  const meshing::TetMesh mesh = meshing::read_mesh(mesh_file);
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, description.side);
  const simulation::PoseLoad prone{"prone", description.pose("prone").gravity};
  const simulation::PoseLoad supine{"supine", description.pose("supine").gravity};
  const simulation::ChainSolution start = simulation::Chain(mesh, anatomy, model, {prone, supine}).solve(model);
  const calibration::ModelSkin skin(mesh, start.poses[0].x);
  const calibration::Measurement measurement{
      supine,
      calibration::Scan(reconstruction::read_surface(*description.pose("supine").surface, description.frame), skin),
      {}};
  const calibration::FreeParameters parameters(model);
  calibration::Evaluator evaluator({&mesh, &anatomy, prone, {&measurement}}, model);
  calibration::FitOptions options;
  options.noise_mm = {description.pose("supine").noise_mm.value_or(0.7)};
  options.near = &start;
  const Fit fit = calibration::fit_least_squares(evaluator, parameters, options);
  const ErrorModel errors = calibration::judge(fit, parameters, false).errors;
  fmt::print("{} draws; error model of the case: single {:.2f} mm, shared {:.2f} mm over {:.0f} mm\n\n", draws,
             errors.nugget_mm, errors.spread_mm, errors.length_mm);
  fmt::print("| errors drawn | parameter | interval holds the truth | if points erred alone |\n|---|---|---|---|\n");
  Coverage coverage(fit, parameters, errors);
  coverage.measure("noise of single points", options.noise_mm[0], 0, draws);
  coverage.measure("and what neighbours share", errors.nugget_mm, errors.spread_mm, draws);
}

}  // namespace
}  // namespace supine

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "bench_interval_coverage CASE MESH.vtu [DRAWS]\n");
    return 2;
  }
  try {
    supine::run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 200);
  } catch (const supine::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
  return 0;
}
