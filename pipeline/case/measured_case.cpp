// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/measured_case.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>

#include "calibration/noise.h"
#include "calibration/outliers.h"
#include "calibration/residuals.h"
#include "calibration/signed_distance.h"
#include "common/error.h"
#include "common/landmarks.h"
#include "pipeline/case/scan_readings.h"
#include "reconstruction/surface_io.h"
#include "simulation/model_fields.h"
#include "simulation/solve/carrying_modulus.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::Measurement;

bool is_fitted(const Case& c, const std::string& pose) {
  return std::find(c.calibrated_poses.begin(), c.calibrated_poses.end(), pose) != c.calibrated_poses.end();
}

simulation::PoseLoad imaged_load(const Case& c) { return {c.imaged_pose, c.imaged().gravity}; }

/// Fitted poses first, then the other measured ones.
std::vector<Pose> measured_poses(const Case& c) {
  std::vector<Pose> poses;
  for (const std::string& name : c.calibrated_poses) {
    const Pose& pose = c.pose(name);
    if (!pose.surface)
      throw InputError(fmt::format(
          "{}: pose '{}' is to be fitted ([calibration] poses) and has no surface; name the measured surface as "
          "`surface` in [pose.{}]",
          (c.folder / "case.toml").string(), name, name));
    poses.push_back(pose);
  }
  for (const Pose& pose : c.poses)
    if (pose.surface && pose.name != c.imaged_pose && !is_fitted(c, pose.name)) poses.push_back(pose);
  return poses;
}

/// The least stiff of a few moduli from twice the softest that carries the body on: that shape is crumpled and like
/// nothing that is measured, and near the end of what a body carries one may stand on either side of a fold.
void solve_stiffer(MeasuredCase& in, const std::vector<simulation::PoseLoad>& loads,
                   const simulation::CarryingModulus& found) {
  constexpr double clear_of_the_end = 2, stiffer = 1.3, most = 4;
  for (double factor = clear_of_the_end;; factor *= stiffer) {
    in.carrying_modulus_kpa = std::min(factor * found.carries_kpa, in.model.breast.young_modulus_kpa.upper);
    const simulation::Model model = in.begin_with(in.model);
    try {
      in.start = simulation::Chain(in.mesh, in.anatomy, model, loads).solve(model, &found.solution);
      return;
    } catch (const simulation::NoEquilibrium&) {
      if (factor * stiffer > most) throw;
    }
  }
}

/// A fit needs a shape to start from: where the given modulus has none, it begins with one that has one.
void start_stiffer(Run& run, MeasuredCase& in, const std::vector<simulation::PoseLoad>& loads, double carried) {
  constexpr double close_enough = 1.3;
  const simulation::Setting& modulus = in.model.breast.young_modulus_kpa;
  simulation::ModulusSearch search{.ratio = close_enough, .softest_kpa = modulus.value, .stiffest_kpa = modulus.upper};
  solve_stiffer(in, loads, simulation::find_carrying_modulus(in.mesh, in.anatomy, in.model, loads, search));
  run.warn(fmt::format(
      "{}: breast.young_modulus_kpa = {:.3g} carries the body under {:.0f} % of gravity only; {:.3g}, which carries "
      "it, is where the search begins (its prior stays). supine-simulate --find-modulus finds the least",
      in.model_text.file.string(), modulus.value, 100 * carried, *in.carrying_modulus_kpa));
}

void solve_start(Run& run, MeasuredCase& in, const std::vector<Pose>& poses) {
  std::vector<simulation::PoseLoad> loads = {imaged_load(in.description)};
  for (const Pose& pose : poses) loads.push_back({pose.name, pose.gravity});
  simulation::Chain chain(in.mesh, in.anatomy, in.model, loads);
  for (std::size_t p = 1; p < loads.size(); ++p)
    simulation::check_effects_act(in.model, {in.mesh, in.anatomy, chain.mechanics().layout(), loads[p].name});
  try {
    in.start = chain.solve(in.model);
  } catch (const simulation::NoEquilibrium& failure) {
    if (!in.model.breast.young_modulus_kpa.free) throw;
    start_stiffer(run, in, loads, failure.load());
  }
}

/// Rows of the scan that are left out; told where there are many.
std::vector<int> left_out(Run& run, const calibration::Scan& scan, const calibration::ModelSkin& skin,
                          double given_noise_mm, const std::string& name, const std::string& body) {
  constexpr double worth_a_warning = 0.001;
  calibration::SignedDistances distances;
  calibration::scan_to_model(skin, scan.points(), distances);
  calibration::Outliers found = calibration::find_outliers(scan.points(), distances, given_noise_mm);
  const double share = static_cast<double>(found.points.size()) / std::max(1, found.over_skin);
  if (share > worth_a_warning) {
    const auto first = scan.points().row(found.points.front());
    run.warn(
        fmt::format("{}: {} of {} points over the {} ({:.1f} %) stand out of their neighbours by more than "
                    "four times the noise ({:.2f} mm), the first at ({:.1f}, {:.1f}, {:.1f}) mm; they are left out",
                    name, found.points.size(), found.over_skin, body, 100 * share, found.noise_mm, first.x(), first.y(),
                    first.z()));
  }
  return std::move(found.points);
}

void read_scan(Run& run, MeasuredCase& in, const Pose& pose, std::size_t row) {
  const std::string name = pose.surface->string();
  const auto surface = reconstruction::read_surface(run.input(*pose.surface), in.description.frame);
  const calibration::ModelSkin skin(in.mesh, in.start.poses[row].x);
  calibration::Scan scan(surface, skin, name);
  std::vector<PosePoints> others;
  for (const simulation::PoseSolution& solved : in.start.poses) others.push_back({solved.name, &solved.x});
  check_scan(run, in.description, pose, scan, in.mesh, skin, in.start.poses[row].x, others);
  auto& list = is_fitted(in.description, pose.name) ? in.fitted : in.held_out;
  std::vector<int> standing_out = left_out(run, scan, skin, pose.noise_mm.value_or(0), name, in.description.body);
  list.push_back(Measurement{{pose.name, pose.gravity}, std::move(scan), pose.noise_mm, std::move(standing_out)});
}

/// What @p work says of a file of landmarks, with its name.
template <class Work>
auto of_landmarks(const Pose& pose, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", pose.landmarks->string(), error.what()));
  }
}

/// Where the model as given has the landmarks of a pose.
Points predicted_places(const MeasuredCase& in, const std::string& pose) {
  const auto solved = std::find_if(in.start.poses.begin(), in.start.poses.end(),
                                   [&pose](const simulation::PoseSolution& s) { return s.name == pose; });
  return simulation::Embedding(in.mesh, in.landmarks.at(pose).imaged).at(solved->x);
}

void read_pose_landmarks(Run& run, MeasuredCase& in, const std::vector<Pose>& poses) {
  const Case& c = in.description;
  if (!c.prone_landmarks) return;
  const Landmarks imaged = read_landmarks(run.input(*c.prone_landmarks), c.frame);
  for (const Pose& pose : poses) {
    if (!pose.landmarks) continue;
    const Landmarks measured = read_landmarks(run.input(*pose.landmarks), c.frame);
    in.landmarks.emplace(pose.name, of_landmarks(pose, [&] { return calibration::pair_landmarks(imaged, measured); }));
    const std::string doubt = calibration::doubt_of_scale(in.landmarks.at(pose.name), predicted_places(in, pose.name));
    if (!doubt.empty()) run.warn(fmt::format("{}: {}", pose.landmarks->string(), doubt));
  }
}

/// Where a model has the landmarks of a pose that can say whether they may lie there. One that is stiffer than the
/// given one, because that has no equilibrium, moves too little: its places are moved to
/// the landmarks' mean, as far as a breast may be off.
Points places_to_judge_by(const MeasuredCase& in, const std::string& pose, const Points& measured) {
  constexpr double furthest_mm = 100;  // that a breast lies, as a whole, from where a stiff one does
  Points places = predicted_places(in, pose);
  if (!in.carrying_modulus_kpa || places.rows() == 0) return places;
  const Eigen::RowVector3d way = measured.colwise().mean() - places.colwise().mean();
  places.rowwise() += way * (furthest_mm / std::max(furthest_mm, way.norm()));
  return places;
}

/// Of a pose, where the model does not speak against them; nullptr where it has none.
const calibration::MeasuredLandmarks* believable_landmarks(const MeasuredCase& in, const std::string& pose) {
  const auto found = in.landmarks.find(pose);
  if (found == in.landmarks.end()) return nullptr;
  of_landmarks(in.description.pose(pose), [&] {
    calibration::check_landmarks(found->second, places_to_judge_by(in, pose, found->second.measured));
  });
  return &found->second;
}

calibration::MeasuredScene scene_of(const MeasuredCase& in, bool whole, bool marked) {
  calibration::MeasuredScene scene{&in.mesh, &in.anatomy, imaged_load(in.description), {}};
  for (const Measurement& m : in.fitted) scene.measurements.push_back(&m);
  for (const Measurement& m : in.held_out)
    if (whole) scene.measurements.push_back(&m);
  for (const Measurement* m : scene.measurements)
    scene.landmarks.push_back(marked ? believable_landmarks(in, m->pose.name) : nullptr);
  return scene;
}

}  // namespace

simulation::Model MeasuredCase::begin_with(simulation::Model wanted) const {
  double& modulus = wanted.breast.young_modulus_kpa.value;
  if (carrying_modulus_kpa) modulus = std::max(modulus, *carrying_modulus_kpa);
  return wanted;
}

void MeasuredCase::check_covers_skin(const std::string& what) const {
  if (std::any_of(fitted.begin(), fitted.end(), [](const Measurement& m) { return !m.scan.is_contour(); })) return;
  throw InputError(
      fmt::format("{}: a contour (rows of points along lines), which covers no skin; {} goes by the MAE model to scan, "
                  "over the skin that is covered. Take supine-calibrate --method least-squares or joint, or a scan of "
                  "a surface",
                  description.pose(fitted.front().pose.name).surface->string(), what));
}

calibration::MeasuredScene MeasuredCase::fitted_scene() const { return scene_of(*this, false, false); }

calibration::MeasuredScene MeasuredCase::marked_scene() const { return scene_of(*this, false, true); }

calibration::MeasuredScene MeasuredCase::whole_scene() const { return scene_of(*this, true, true); }

std::vector<double> MeasuredCase::noise_mm(calibration::Evaluator& evaluator) const {
  const auto& measurements = evaluator.scene().measurements;
  std::vector<double> noise;
  const std::vector<double> placeholder(measurements.size(), 1.0);
  calibration::Prediction prediction;
  for (std::size_t m = 0; m < measurements.size(); ++m) {
    if (measurements[m]->noise_mm) {
      noise.push_back(*measurements[m]->noise_mm);
      continue;
    }
    if (prediction.poses.empty()) prediction = evaluator.predict(begin_with(model), &start);
    auto mask = calibration::points_over_skin(prediction);
    for (std::size_t other = 0; other < mask.size(); ++other)
      if (other != m) mask[other].setConstant(false);
    const auto residuals = calibration::residuals_of(evaluator.scene(), prediction, mask, placeholder);
    const Eigen::Index rows = residuals.skin_rows();
    noise.push_back(calibration::estimate_noise_mm(residuals.on_skin.topRows(rows), residuals.distance_mm.head(rows)));
  }
  return noise;
}

std::unique_ptr<MeasuredCase> measure_case(Run& run, CaseInputs inputs) {
  auto in = std::make_unique<MeasuredCase>();
  static_cast<CaseInputs&>(*in) = std::move(inputs);
  const std::vector<Pose> poses = measured_poses(in->description);
  solve_start(run, *in, poses);
  for (std::size_t p = 0; p < poses.size(); ++p) read_scan(run, *in, poses[p], p);
  read_pose_landmarks(run, *in, poses);
  return in;
}

std::unique_ptr<MeasuredCase> read_measured_case(Run& run, const fs::path& folder, const fs::path& mesh_file,
                                                 const fs::path& model_file) {
  return measure_case(run, read_case_inputs(run, folder, mesh_file, model_file));
}

struct LiveProgress::State {
  const Run& run;
  std::chrono::seconds pause;
  std::mutex mutex;
  bool at_once = run.has_listener() || isatty(STDERR_FILENO) != 0;
  std::chrono::steady_clock::time_point last = std::chrono::steady_clock::now();
};

LiveProgress::LiveProgress(const Run& run, std::chrono::seconds pause) : state_(new State{run, pause, {}}) {}
LiveProgress::~LiveProgress() = default;

void LiveProgress::show(const std::string& line) {
  const std::lock_guard lock(state_->mutex);
  if (state_->at_once) return state_->run.progress(line);
  const auto now = std::chrono::steady_clock::now();
  if (now - state_->last < state_->pause) return;
  state_->last = now;
  state_->run.say("  " + line);
}

}  // namespace supine::pipeline
