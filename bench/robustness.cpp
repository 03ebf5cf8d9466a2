// SPDX-License-Identifier: AGPL-3.0-or-later
//
// How often the chain finds what is there, and whether it ever says something wrong: random parameter sets on
// breast-like shapes. Each is run with default options; where that fails, much finer load steps decide whether there is
// an equilibrium at all. What was found is judged afresh. One CSV per shape, continued where it stopped;
// bench/robustness_table.py makes the tables. Exit 1 when an answer was wrong without a word.

#include <fmt/format.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "bench/robustness_cases.h"
#include "common/error.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/linear_solver.h"

namespace {

using namespace supine;
namespace fs = std::filesystem;

constexpr double round_trip_bound_mm = 1e-6, residual_bound = 1e-6, path_bound_mm = 1e-3;

struct Arguments {
  fs::path folder;
  int shapes = bench::robustness_shapes, sets = bench::robustness_sets, threads = 2;
  bool fresh = false;
};

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

simulation::SolveOptions finest() {
  simulation::SolveOptions options;
  options.max_iterations = 200;
  options.smallest_load_step = 1.0 / 4096;
  return options;
}

/// What a run said, and what a fresh look at its answer says.
struct Outcome {
  bool found = false;  ///< undeformed and supine shape
  std::string words;   ///< of the failure, or of the round trip
  double seconds = 0;  ///< CPU
  int newton = 0, load_steps = 0;
  double round_trip_mm = 0, min_det_f = 1, residual = 0, path_mm = 0;
  bool named = false;   ///< a second balanced shape was told of
  bool minimum = true;  ///< the supine energy curves upwards
  bool certified() const { return found && !named && round_trip_mm <= round_trip_bound_mm; }
  bool wrong() const {
    return certified() && (!(min_det_f > 0) || !(residual <= residual_bound) || !minimum || path_mm > path_bound_mm);
  }
};

/// Judges the supine shape with a new Mechanics: inversion, balance, curvature, and the way over the prone shape.
void judge(const bench::RobustnessShape& shape, const simulation::Model& model,
           const simulation::ChainSolution& solution, Outcome& outcome) {
  const Points &X = solution.X, &x = solution.poses[0].x;
  outcome.min_det_f = std::min(simulation::cell_det_f(shape.mesh.cells, x, X).minCoeff(),
                               simulation::cell_det_f(shape.mesh.cells, shape.mesh.points, X).minCoeff());
  simulation::Mechanics mechanics(shape.mesh, shape.anatomy, model);
  const auto load = [&](const simulation::PoseLoad& pose) {
    mechanics.set_fields(simulation::values_of(
        simulation::make_fields(model, {shape.mesh, shape.anatomy, mechanics.layout(), pose.name}, pose.gravity)));
  };
  simulation::Sums sums(mechanics.pattern());
  for (const auto& [pose, deformed] : {std::pair(shape.poses[0], shape.mesh.points), std::pair(shape.poses[1], x)}) {
    load(pose);
    mechanics.evaluate({X, X, 1.0}, {.residual = true}, sums);
    const double weight = sums.residual.norm();
    mechanics.evaluate({deformed, X, 1.0}, {.residual = true, .tangent = true}, sums);
    outcome.residual = std::max(outcome.residual, sums.residual.norm() / weight);
  }
  if (mechanics.has_energy()) outcome.minimum = simulation::CholeskySolver(sums.tangent).factorise(sums.tangent);
  simulation::EquilibriumSolver solver(mechanics);
  Points other;
  try {
    solver.forward(X, other, "prone → supine", &shape.mesh.points);
    outcome.path_mm = (other - x).rowwise().norm().maxCoeff();
  } catch (const NumericalFailure&) {
    outcome.path_mm = 0;  // the other way leads nowhere: no second answer
  }
}

Outcome run(const bench::RobustnessShape& shape, const simulation::Model& model,
            const simulation::SolveOptions& options) {
  Outcome outcome;
  const double start = thread_seconds();
  try {
    const auto solution = simulation::solve_chain(shape.mesh, shape.anatomy, model, shape.poses,
                                                  simulation::InverseMethod::newton, options);
    outcome.seconds = thread_seconds() - start;
    outcome.found = true;
    outcome.newton = solution.inverse.newton_iterations + solution.poses[0].report.newton_iterations;
    outcome.load_steps = solution.inverse.load_steps + solution.poses[0].report.load_steps;
    outcome.round_trip_mm = solution.round_trip_max_mm;
    outcome.named = solution.poses[0].second_shape_mm > path_bound_mm;
    if (outcome.round_trip_mm > round_trip_bound_mm) outcome.words = "round trip: another equilibrium";
    if (outcome.named) outcome.words = "two balanced shapes";
    judge(shape, model, solution, outcome);
  } catch (const NumericalFailure& failure) {
    outcome.seconds = thread_seconds() - start;
    outcome.words = failure.what();
  }
  std::replace(outcome.words.begin(), outcome.words.end(), '"', '\'');
  return outcome;
}

const char* const header =
    "shape,set,height_mm,law,skin_law,young_kpa,poisson,skin_kpa,load_number,found,certified,wrong,newton,load_steps,"
    "cpu_seconds,round_trip_mm,min_det_f,residual,minimum,path_mm,fine_found,fine_certified,fine_seconds,words";

std::string row(int index, int set, const bench::RobustnessShape& shape, std::atomic<int>& wrong) {
  const simulation::Model model = bench::robustness_model(set);
  const Outcome first = run(shape, model, {});
  Outcome fine = first;
  if (!first.certified()) fine = run(shape, model, finest());
  wrong += first.wrong() + (!first.certified() && fine.wrong());
  return fmt::format(
      "{},{},{:.1f},{},{},{:.4f},{:.4f},{:.3f},{:.3f},{:d},{:d},{:d},{},{},{:.4f},{:.3e},{:.4f},{:.2e},{:d},"
      "{:.2e},{:d},{:d},{:.4f},\"{}\"",
      index, set, shape.height_mm, simulation::name_of(model.breast.law),
      model.skin.law == simulation::SkinLaw::neo_hookean ? "neo_hookean" : "corotational",
      model.breast.young_modulus_kpa.value, model.breast.poisson_ratio.value, model.skin.young_modulus_kpa.value,
      simulation::load_number(shape.anatomy, model), first.found, first.certified(), first.wrong(), first.newton,
      first.load_steps, first.seconds, first.round_trip_mm, first.min_det_f, first.residual, first.minimum,
      first.path_mm, fine.found, fine.certified(), fine.seconds, first.words);
}

/// Rows already there, header not counted; a row cut off by an interruption is dropped.
int finished_rows(const fs::path& file) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  text.erase(text.find_last_of('\n') == std::string::npos ? 0 : text.find_last_of('\n') + 1);
  in.close();
  if (!text.empty()) std::ofstream(file) << text;
  return std::max(0, static_cast<int>(std::count(text.begin(), text.end(), '\n')) - 1);
}

void run_shape(const Arguments& arguments, int index, std::atomic<int>& wrong) {
  const fs::path file = arguments.folder / fmt::format("shape_{:02}.csv", index);
  if (arguments.fresh) fs::remove(file);
  const int done = finished_rows(file);
  if (done >= arguments.sets) return;
  const bench::RobustnessShape shape = bench::robustness_shape(index);
  std::ofstream out(file, std::ios::app);
  if (done == 0 && fs::file_size(file) == 0) out << header << std::endl;
  for (int set = done; set < arguments.sets; ++set) out << row(index, set, shape, wrong) << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Robustness of the chain on random parameters and breast-like shapes");
  app.add_option("folder", arguments.folder, "where the CSV files go, or are continued")->required();
  app.add_option("--shapes", arguments.shapes, "how many, spread over the heights")
      ->check(CLI::Range(1, bench::robustness_shapes));
  app.add_option("--sets", arguments.sets, "parameter sets per shape")->check(CLI::Range(1, bench::robustness_sets));
  app.add_option("--threads", arguments.threads, "shapes at a time")->check(CLI::Range(1, 64));
  app.add_flag("--fresh", arguments.fresh, "begin anew instead of continuing");
  CLI11_PARSE(app, argc, argv);
  fs::create_directories(arguments.folder);
  std::atomic<int> wrong = 0, broken = 0;
  const int stride = bench::robustness_shapes / arguments.shapes;
#pragma omp parallel for schedule(dynamic) num_threads(arguments.threads)
  for (int s = arguments.shapes - 1; s >= 0; --s) {
    try {
      run_shape(arguments, s * stride, wrong);
    } catch (const std::exception& error) {
#pragma omp critical
      std::cerr << fmt::format("shape {}: {}\n", s * stride, error.what());
      ++broken;
    }
  }
  std::cout << fmt::format("{} shapes, {} sets each; new answers that are wrong without a word: {}\n", arguments.shapes,
                           arguments.sets, wrong.load());
  return broken > 0 ? 3 : wrong > 0 ? 1 : 0;
}
