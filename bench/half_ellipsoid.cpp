// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Gravity along -z on the half ellipsoid that SOFA and CalculiX were run on (docs/verification.md), stage 2 with the
// shape of stage 1 taken as stress-free; or the round trip prone → undeformed → prone by one of the inverses.

#include <fmt/format.h>
#include <fmt/os.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>

#include "bench/ellipsoid.h"
#include "common/error.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/chain.h"

namespace {

using namespace supine;

struct Arguments {
  std::string mesh, skin_file, law = "neo_hookean", compression = "full", nodes, round_trip;
  double young_kpa = 1, skin_kpa = 22.7;
  int stages = 2, order = 1;
};

double seconds() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

simulation::Model model_of(const Arguments& arguments) {
  for (const auto& [name, law] : simulation::bulk_law_names())
    if (name == arguments.law)
      return bench::ellipsoid_model(
          law, arguments.young_kpa, arguments.skin_kpa,
          arguments.compression == "full" ? simulation::Compression::full : simulation::Compression::tension_field);
  throw InputError("unknown law " + arguments.law);
}

void run_stages(const Arguments& arguments, meshing::TetMesh mesh) {
  const Points start = mesh.points;
  std::string rows = "stage,node,ux_mm,uy_mm,uz_mm\n";
  for (int stage = 1; stage <= arguments.stages; ++stage) {
    const simulation::Model model = model_of(arguments);
    const meshing::Anatomy anatomy = bench::ellipsoid_anatomy(mesh);
    simulation::Mechanics mechanics(mesh, anatomy, model);
    mechanics.set_fields(simulation::values_of(
        simulation::make_fields(model, {mesh, anatomy, mechanics.layout(), "prone"}, -Eigen::Vector3d::UnitZ())));
    simulation::EquilibriumSolver solver(mechanics);
    Points x;
    const auto report = solver.forward(mesh.points, x, fmt::format("stage {}", stage));
    std::cout << fmt::format(
        "stage {}: tip u_z {:.4f} mm, total {:.4f}, {} Newton, {} factorisations, {} load steps, min det F {:.3f}, at "
        "{:.3f} s\n",
        stage, x(0, 2) - mesh.points(0, 2), x(0, 2) - start(0, 2), report.newton_iterations, report.factorisations,
        report.load_steps, report.min_det_f, seconds());
    mesh.points = x;
    if (arguments.nodes.empty()) continue;
    const Points moved = x - start;
    for (Eigen::Index n = 0; n < moved.rows(); ++n)
      rows += fmt::format("{},{},{:.12g},{:.12g},{:.12g}\n", stage, n, moved(n, 0), moved(n, 1), moved(n, 2));
  }
  if (!arguments.nodes.empty()) fmt::output_file(arguments.nodes).print("{}", rows);
}

void run_round_trip(const Arguments& arguments, const meshing::TetMesh& mesh) {
  using simulation::InverseMethod;
  static const std::map<std::string, InverseMethod> methods = {{"newton", InverseMethod::newton},
                                                               {"fixed-point", InverseMethod::fixed_point},
                                                               {"reversed-gravity", InverseMethod::reversed_gravity}};
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const auto solution = simulation::solve_chain(mesh, bench::ellipsoid_anatomy(mesh), model_of(arguments),
                                                {{"prone", -down}, {"supine", down}}, methods.at(arguments.round_trip));
  const auto sag = (solution.X - mesh.points).rowwise().norm().maxCoeff();
  std::cout << fmt::format(
      "{}: {} Newton, undeformed {:.3f} mm away at most, round trip {:.3g} mm max, {:.3g} rms, supine tip {:.3f} mm, "
      "at "
      "{:.3f} s\n",
      arguments.round_trip, solution.inverse.newton_iterations, sag, solution.round_trip_max_mm,
      solution.round_trip_rms_mm, solution.poses[0].x(0, 2) - mesh.points(0, 2), seconds());
}

}  // namespace

int main(int argc, char** argv) try {
  seconds();
  Arguments arguments;
  CLI::App app("The half ellipsoid of docs/verification.md");
  app.add_option("mesh", arguments.mesh, "breast_3k.vtk, …: tetrahedra, metres")->required();
  app.add_option("skin", arguments.skin_file, "ignored: the skin is every face off the base");
  app.add_option("young_kpa", arguments.young_kpa, "Young's modulus of the breast, kPa");
  app.add_option("law", arguments.law, "breast.law of model.toml");
  app.add_option("skin_kpa", arguments.skin_kpa, "Young's modulus of the skin, kPa; 0 = none");
  app.add_option("compression", arguments.compression)->check(CLI::IsMember({"full", "tension_field"}));
  app.add_option("--stages", arguments.stages)->check(CLI::Range(1, 2));
  app.add_option("--order", arguments.order)->check(CLI::Range(1, 2));
  app.add_option("--nodes", arguments.nodes, "write the total displacement of every node after each stage, CSV");
  app.add_option("--round-trip", arguments.round_trip, "prone → undeformed → prone by this inverse, in place of stages")
      ->check(CLI::IsMember({"newton", "fixed-point", "reversed-gravity"}));
  CLI11_PARSE(app, argc, argv);
  const meshing::TetMesh mesh = bench::read_ellipsoid(arguments.mesh, arguments.order);
  std::cout << fmt::format("read {:.3f} s, {} nodes, {} tetrahedra\n", seconds(), mesh.points.rows(),
                           mesh.cells.rows());
  arguments.round_trip.empty() ? run_stages(arguments, mesh) : run_round_trip(arguments, mesh);
  return 0;
} catch (const supine::Error& error) {
  std::cerr << error.what() << "\n";
  return 3;
}
