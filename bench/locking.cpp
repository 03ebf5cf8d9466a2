// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Volumetric locking: a soft block of 40 mm, 3 kPa, on its clamped base (or, with 0.8 kPa, under skin on a sliding base
// between elastic cuts) while gravity pulls sideways and down. Displacement on coarse meshes against a fine one, RMS
// over the corner nodes they share, as a share of the RMS displacement; linear cells, quadratic cells with the volume
// pointwise or by the cell's mean.
//
//   bench_locking [clamped|sliding] [law] [finest]     finest: cubes per edge of the reference mesh, 8; a multiple of 4

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>

#include "common/error.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/equilibrium.h"
#include "tests/simulation/scene.h"

namespace {

using namespace supine;
using namespace supine::simulation;

constexpr double size_mm = 40;

struct Problem {
  bool clamped = true;
  BulkLaw law = BulkLaw::neo_hookean;
};

/// Displacement of the nodes, by their place in the grid of eighths of the block that the meshes share.
using Movement = std::map<std::array<int, 3>, Eigen::RowVector3d>;

struct Answer {
  Movement moved;
  int iterations = 0;
};

Model model_of(const Problem& problem, double poisson, Volumetric volumetric) {
  Model model;
  model.breast.law = problem.law;
  model.breast.volumetric = volumetric;
  model.breast.poisson_ratio.value = poisson;
  model.breast.young_modulus_kpa.value = problem.clamped ? 3 : 0.8;
  if (problem.clamped) {
    model.skin.young_modulus_kpa.value = 0;
    model.interface.kind = InterfaceKind::fixed;
    model.cut.stiffness_kpa_per_mm.value = 0;
  } else {
    model.cut.stiffness_kpa_per_mm.value = 0.05;
  }
  return model;
}

Answer solve(const Problem& problem, int n, int order, Volumetric volumetric, double poisson) {
  testing::TestScene scene = testing::box_scene(n, {size_mm, size_mm, size_mm});
  if (order == 2) {
    scene.mesh = testing::quadratic(scene.mesh);
    scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  }
  const Model model = model_of(problem, poisson, volumetric);
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  const Eigen::Vector3d pull(0.8, 0, -0.6);
  mechanics.set_fields(
      values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, pull)));
  EquilibriumSolver solver(mechanics);
  Points x;
  Answer answer;
  try {
    answer.iterations = solver.forward(scene.mesh.points, x, "block").newton_iterations;
  } catch (const NumericalFailure&) {
    return answer;
  }
  for (Eigen::Index p = 0; p < x.rows(); ++p) {
    const Eigen::RowVector3d place = scene.mesh.points.row(p) * (8 / size_mm);
    const Eigen::RowVector3d near = place.array().round();
    if ((place - near).norm() < 1e-6)
      answer.moved[{int(near.x()), int(near.y()), int(near.z())}] = x.row(p) - scene.mesh.points.row(p);
  }
  return answer;
}

double rms(const Movement& moved) {
  double sum = 0;
  for (const auto& [place, way] : moved) sum += way.squaredNorm();
  return std::sqrt(sum / static_cast<double>(moved.size()));
}

std::string cell_of(const Answer& answer, const Answer& reference) {
  if (answer.moved.empty()) return "no answer";
  Movement error, truth;
  for (const auto& [place, way] : answer.moved)
    if (const auto there = reference.moved.find(place); there != reference.moved.end()) {
      error[place] = way - there->second;
      truth[place] = there->second;
    }
  return fmt::format("{:.2f} % ({})", 100 * rms(error) / rms(truth), answer.iterations);
}

}  // namespace

int main(int argc, char** argv) {
  Problem problem;
  problem.clamped = argc < 2 || std::string(argv[1]) != "sliding";
  for (const auto& [name, value] : bulk_law_names())
    if (argc > 2 && name == argv[2]) problem.law = value;
  const int finest = argc > 3 ? std::atoi(argv[3]) : 8;
  std::cout << fmt::format("{} block, {}; reference: quadratic, mean volume, {} cubes per edge. Error (Newton steps)\n",
                           problem.clamped ? "clamped" : "sliding", name_of(problem.law), finest);
  std::cout << "| ν | RMS mm | linear 4 | linear 8 | quadratic pointwise 2 | 4 | quadratic mean 2 | 4 |\n";
  for (const double nu : {0.3, 0.45, 0.47, 0.49, 0.499, 0.4999}) {
    const Answer reference = solve(problem, finest, 2, Volumetric::mean, nu);
    std::cout << fmt::format("| {} | {:.3f} |", nu, rms(reference.moved)) << std::flush;
    for (const int n : {4, 8})
      std::cout << ' ' << cell_of(solve(problem, n, 1, Volumetric::pointwise, nu), reference) << " |" << std::flush;
    for (const Volumetric volumetric : {Volumetric::pointwise, Volumetric::mean})
      for (const int n : {2, 4})
        std::cout << ' ' << cell_of(solve(problem, n, 2, volumetric, nu), reference) << " |" << std::flush;
    std::cout << std::endl;
  }
}
