// SPDX-License-Identifier: AGPL-3.0-or-later
//
// What one forward and one inverse solve cost on a half ellipsoid mesh, beside the factorisations alone: one CSV row.
// One process per mesh, so that the peak memory is its own. bench/cost_vs_size.py makes the meshes and the plot.

#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>

#include "bench/ellipsoid.h"
#include "common/error.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/equilibrium.h"
#include "simulation/solve/linear_solver.h"

namespace {

using namespace supine;

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

long peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

double wall_seconds() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Wall seconds of a call.
template <class F>
double timed(const F& f) {
  const double start = wall_seconds();
  f();
  return wall_seconds() - start;
}

struct Row {
  double read = 0, setup = 0, assembly = 0, cholesky_analysis = 0, cholesky = 0, forward = 0, lu_analysis = 0, lu = 0,
         inverse = 0;
  simulation::SolveReport forward_report, inverse_report;
  long forward_mb = 0;
};

/// The factorisations are those of the first Newton step, at x = X without load.
void measure(const meshing::TetMesh& mesh, const simulation::Model& model, bool with_inverse, Row& row) {
  const meshing::Anatomy anatomy = bench::ellipsoid_anatomy(mesh);
  std::unique_ptr<simulation::Mechanics> mechanics;
  row.setup = timed([&] {
    mechanics = std::make_unique<simulation::Mechanics>(mesh, anatomy, model);
    mechanics->set_fields(simulation::values_of(
        simulation::make_fields(model, {mesh, anatomy, mechanics->layout(), "prone"}, -Eigen::Vector3d::UnitZ())));
  });
  const Points& X = mesh.points;
  Points sought;
  {
    simulation::EquilibriumSolver solver(*mechanics);
    row.forward = timed([&] { row.forward_report = solver.forward(X, sought, "forward"); });
    row.forward_mb = peak_mb();
  }
  {
    simulation::Sums sums(mechanics->pattern());
    row.assembly = timed([&] {
      mechanics->evaluate({X, X}, {.energy = true, .residual = true, .tangent = true}, sums);
    });
    std::unique_ptr<simulation::CholeskySolver> solver;
    row.cholesky_analysis = timed([&] { solver = std::make_unique<simulation::CholeskySolver>(sums.tangent); });
    row.cholesky = timed([&] { solver->factorise(sums.tangent); });
  }
  if (!with_inverse) return;
  {
    simulation::EquilibriumSolver solver(*mechanics);
    row.inverse = timed([&] { row.inverse_report = solver.inverse(X, sought, "inverse"); });
  }
  simulation::Sums sums(mechanics->pattern());
  mechanics->evaluate({X, X}, {.residual = true, .reference_tangent = true}, sums);
  std::unique_ptr<simulation::LuSolver> solver;
  row.lu_analysis = timed([&] { solver = std::make_unique<simulation::LuSolver>(sums.reference_tangent); });
  row.lu = timed([&] { solver->factorise(sums.reference_tangent); });
}

}  // namespace

int main(int argc, char** argv) try {
  wall_seconds();
  std::string file, law = "neo_hookean";
  int order = 1;
  double young_kpa = 1, skin_kpa = 22.7;
  bool no_inverse = false, header = false;
  CLI::App app("Cost of one forward and one inverse solve");
  app.add_option("mesh", file, "half ellipsoid, legacy VTK, metres")->required();
  app.add_option("--order", order)->check(CLI::Range(1, 2));
  app.add_option("--law", law);
  app.add_option("--young-kpa", young_kpa);
  app.add_option("--skin-kpa", skin_kpa, "tension field; 0 = none");
  app.add_flag("--no-inverse", no_inverse, "the forward solve alone");
  app.add_flag("--header", header, "print the column names first");
  CLI11_PARSE(app, argc, argv);
  Row row;
  meshing::TetMesh mesh;
  row.read = timed([&] { mesh = bench::read_ellipsoid(file, order); });
  simulation::BulkLaw bulk{};
  for (const auto& [name, value] : simulation::bulk_law_names())
    if (name == law) bulk = value;
  measure(mesh, bench::ellipsoid_model(bulk, young_kpa, skin_kpa, simulation::Compression::tension_field), !no_inverse,
          row);
  if (header)
    std::cout << "order,tets,nodes,dofs,read_s,setup_s,assembly_s,cholesky_analysis_s,cholesky_s,forward_s,"
                 "forward_newton,forward_factorisations,forward_mb,lu_analysis_s,lu_s,inverse_s,inverse_newton,"
                 "inverse_factorisations,peak_mb,cpu_s,wall_s\n";
  std::cout << fmt::format(
      "{},{},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{:.4f},{:.4f},{:.4f},{},{},{},"
      "{:.2f},{:.2f}\n",
      order, mesh.cells.rows(), mesh.points.rows(), 3 * mesh.points.rows(), row.read, row.setup, row.assembly,
      row.cholesky_analysis, row.cholesky, row.forward, row.forward_report.newton_iterations,
      row.forward_report.factorisations, row.forward_mb, row.lu_analysis, row.lu, row.inverse,
      row.inverse_report.newton_iterations, row.inverse_report.factorisations, peak_mb(), cpu_seconds(),
      wall_seconds());
  return 0;
} catch (const supine::Error& error) {
  std::cerr << error.what() << "\n";
  return 3;
}
