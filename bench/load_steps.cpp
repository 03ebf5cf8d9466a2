// SPDX-License-Identifier: AGPL-3.0-or-later
//
// The slow way beside supine-simulate: gravity grows in small equal steps, each from the shape of the last, on the way
// to the undeformed shape, to supine and back to prone. Writes how it ended as JSON, and how far the supine nodes lie
// from those of a folder of results.
//
//   bench_load_steps CASE MESH.vtu MODEL.toml RESULT.json [--steps 32] [--like FOLDER]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_file.h"
#include "simulation/model_fields.h"
#include "simulation/solve/equilibrium.h"

namespace {

using namespace supine;
namespace fs = std::filesystem;

constexpr double round_trip_bound_mm = 1e-6;

struct Arguments {
  fs::path case_folder, mesh, model, result, like;
  int steps = 32;
};

class SmallSteps {
 public:
  SmallSteps(const Arguments& arguments)
      : steps_(arguments.steps),
        measured_(pipeline::read_case(arguments.case_folder)),
        model_(pipeline::read_model(arguments.model)),
        mesh_(meshing::read_mesh(arguments.mesh)),
        anatomy_(meshing::compute_anatomy(mesh_, measured_.side)),
        mechanics_(mesh_, anatomy_, model_),
        solver_(mechanics_) {}

  Points undeformed() { return follow("prone", mesh_.points, true); }
  Points deformed(const std::string& pose, const Points& X) { return follow(pose, X, false); }
  const Points& prone() const { return mesh_.points; }

 private:
  Points follow(const std::string& pose, const Points& known, bool inverse) {
    const simulation::Scene scene{mesh_, anatomy_, mechanics_.layout(), pose};
    const auto whole = simulation::values_of(simulation::make_fields(model_, scene, measured_.pose(pose).gravity));
    Points sought = known;
    for (int step = 1; step <= steps_; ++step) {
      auto fields = whole;
      fields.gravity *= static_cast<double>(step) / steps_;
      mechanics_.set_fields(fields);
      const Points start = sought;
      const std::string what = fmt::format("{}, step {} of {}", pose, step, steps_);
      inverse ? solver_.inverse(known, sought, what, &start) : solver_.forward(known, sought, what, &start);
    }
    return sought;
  }

  int steps_;
  pipeline::Case measured_;
  simulation::Model model_;
  meshing::TetMesh mesh_;
  meshing::Anatomy anatomy_;
  simulation::Mechanics mechanics_;
  simulation::EquilibriumSolver solver_;
};

double apart_mm(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

nlohmann::json solve(const Arguments& arguments) {
  SmallSteps chain(arguments);
  nlohmann::json result;
  try {
    const Points X = chain.undeformed(), supine = chain.deformed("supine", X);
    const fs::path other = arguments.like / "supine.vtu";
    if (fs::exists(other)) result["apart_mm"] = apart_mm(supine, meshing::read_mesh(other).points);
    const double round_trip = apart_mm(chain.deformed("prone", X), chain.prone());
    result["round_trip_mm"] = round_trip;
    result["outcome"] = round_trip <= round_trip_bound_mm ? "certificate" : "several equilibria";
  } catch (const NumericalFailure& failure) {
    result["outcome"] = "no equilibrium";
    result["said"] = failure.what();
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("The chain in small load steps");
  app.add_option("case", arguments.case_folder)->required();
  app.add_option("mesh", arguments.mesh)->required();
  app.add_option("model", arguments.model)->required();
  app.add_option("result", arguments.result)->required();
  app.add_option("--steps", arguments.steps)->check(CLI::Range(1, 4096));
  app.add_option("--like", arguments.like, "folder with a supine.vtu of the same mesh");
  CLI11_PARSE(app, argc, argv);
  try {
    std::ofstream(arguments.result) << solve(arguments) << "\n";
    return 0;
  } catch (const Error& error) {
    std::cerr << "bench_load_steps: error: " << error.what() << "\n";
    return 3;
  }
}
