// SPDX-License-Identifier: AGPL-3.0-or-later
//
// What the pieces of a solve cost on the mesh of a breast, at the solved supine pose: sums over the elements, a
// Cholesky factor, a cycle of p-multigrid (quadratic cells), and the Krylov iterations that each needs. Processor
// seconds. Gravity goes along the muscle's outward normal and back.
//
//   bench_linear_solvers MESH.vtu [--side left] [--young-kpa 0.5] [--skin-kpa 20] [--poisson 0.45] [--chain]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <ctime>
#include <filesystem>
#include <iostream>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "simulation/model_fields.h"
#include "simulation/solve/chain.h"
#include "simulation/solve/krylov.h"
#include "simulation/solve/linear_solver.h"
#include "simulation/solve/p_multigrid.h"
#include "simulation/solve/pushed_forward.h"

namespace {

using namespace supine;
using simulation::SparseMatrix;

/// Processor seconds of a call, all threads.
template <class F>
double timed(const F& f) {
  const std::clock_t start = std::clock();
  f();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void row(const std::string& what, double seconds) { std::cout << fmt::format("{:<44} {:9.4f} s\n", what, seconds); }

/// Iterations and seconds of conjugate gradients on the tangent, and of GMRES on that of the undeformed shape.
void iterate(const std::string& name, const simulation::SpdSolver& solver, const simulation::Sums& sums,
             const Points& x, const Points& X, const Indices& cells) {
  simulation::Krylov krylov(sums.residual.size());
  const Eigen::VectorXd b = Eigen::VectorXd::Random(sums.residual.size()).cwiseProduct(sums.tangent.diagonal());
  Eigen::VectorXd step;
  const auto matrix = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out.noalias() = sums.tangent.transpose() * in;
  };
  const auto reference = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out.noalias() = sums.reference_tangent * in;
  };
  const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { solver.solve(in, out); };
  auto back = simulation::nodal_deformation(cells, x, X);
  for (auto& f : back) f = -f.inverse().eval();
  const auto pulled_back = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    solver.solve(in, out);
    for (std::size_t n = 0; n < back.size(); ++n) {
      auto at = out.segment<3>(3 * static_cast<Eigen::Index>(n));
      at = (back[n] * at).eval();
    }
  };
  for (const double tolerance : {1e-2, 1e-6}) {
    simulation::KrylovReport report;
    const simulation::KrylovOptions options{.tolerance = tolerance, .max_iterations = 300};
    const double cg = timed([&] { report = krylov.conjugate_gradients(matrix, inverse, b, options, step); });
    row(fmt::format("{}: CG to {:.0e}, {} iterations", name, tolerance, report.iterations), cg);
    const double gmres = timed([&] { report = krylov.gmres(reference, pulled_back, b, options, step); });
    row(fmt::format("{}: GMRES to {:.0e}, {} iterations", name, tolerance, report.iterations), gmres);
  }
}

struct Arguments {
  std::filesystem::path mesh;
  std::string side = "left";
  double young_kpa = 0.5, skin_kpa = 20, poisson = 0.45;
  bool chain = false;
};

simulation::Model model_of(const Arguments& arguments) {
  simulation::Model model;
  model.breast.young_modulus_kpa.value = arguments.young_kpa;
  model.breast.poisson_ratio.value = arguments.poisson;
  model.breast.density_refers_to = simulation::DensityReference::undeformed;
  model.skin.young_modulus_kpa.value = arguments.skin_kpa;
  return model;
}

void measure(const Arguments& arguments) {
  const simulation::Model model = model_of(arguments);
  const meshing::TetMesh mesh = meshing::read_mesh(arguments.mesh);
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, arguments.side);
  const std::vector<simulation::PoseLoad> poses = {{"prone", anatomy.outward}, {"supine", -anatomy.outward}};
  simulation::Chain chain(mesh, anatomy, model, poses);
  simulation::ChainSolution solution;
  row("prone to undeformed to supine", timed([&] { solution = chain.solve(model); }));
  const auto& supine = solution.poses[0];
  std::cout << fmt::format(
      "{} cells of order {}, {} unknowns; inverse {} steps, {} factors; supine {} steps, {} factors\n",
      mesh.cells.rows(), mesh.order(), 3 * mesh.points.rows(), solution.inverse.newton_iterations,
      solution.inverse.factorisations, supine.report.newton_iterations, supine.report.factorisations);
  std::cout << fmt::format("supine at {:.9f} mm\n", supine.x.rowwise().norm().mean());
  if (arguments.chain) return;
  simulation::Mechanics mechanics(mesh, anatomy, model);
  mechanics.set_fields(values_of(chain.fields(model, poses[1])));
  simulation::Sums sums(mechanics.pattern());
  const simulation::State state{supine.x, solution.X};
  row("residual and tangent",
      timed([&] { mechanics.evaluate(state, {.energy = true, .residual = true, .tangent = true}, sums); }));
  row("residual and tangent of the undeformed shape",
      timed([&] { mechanics.evaluate(state, {.residual = true, .reference_tangent = true}, sums); }));
  row("both",
      timed([&] { mechanics.evaluate(state, {.residual = true, .tangent = true, .reference_tangent = true}, sums); }));
  Eigen::VectorXd b = Eigen::VectorXd::Random(sums.residual.size()), out = b;
  row("matrix times vector", timed([&] { out.noalias() = sums.tangent.transpose() * b; }));
  std::unique_ptr<simulation::SpdSolver> solver;
  const auto one = [&](const std::string& name) {
    bool done = false;
    row(name + ": factor or set-up", timed([&] { done = solver->factorise(sums.tangent); }));
    if (!done) std::cout << "not positive definite\n";
    row(name + ": solve or cycle", timed([&] {
                                     for (int i = 0; i < 5; ++i) solver->solve(b, out);
                                   }) / 5);
    if (done) iterate(name, *solver, sums, supine.x, solution.X, mesh.cells);
  };
  row("Cholesky: analysis", timed([&] { solver = std::make_unique<simulation::CholeskySolver>(sums.tangent); }));
  one("Cholesky");
  if (mesh.order() == 2) {
    row("p-multigrid: analysis",
        timed([&] { solver = std::make_unique<simulation::PMultigrid>(sums.tangent, mesh.cells); }));
    one("p-multigrid");
  }
}

}  // namespace

int main(int argc, char** argv) try {
  Arguments arguments;
  CLI::App app("What the pieces of a solve cost");
  app.add_option("mesh", arguments.mesh)->required();
  app.add_option("--side", arguments.side);
  app.add_option("--young-kpa", arguments.young_kpa);
  app.add_option("--skin-kpa", arguments.skin_kpa);
  app.add_option("--poisson", arguments.poisson);
  app.add_flag("--chain", arguments.chain, "the whole solve alone");
  CLI11_PARSE(app, argc, argv);
  measure(arguments);
  return 0;
} catch (const supine::Error& error) {
  std::cerr << error.what() << "\n";
  return 3;
}
