// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "common/error.h"
#include "diagnosis/weighted_fit.h"
#include "meshing/imaged_mesh.h"
#include "pipeline/case/case_priors.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/case/model_checks.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/results/targets_report.h"
#include "pipeline/tool/lineage.h"
#include "pipeline/work/diagnose.h"
#include "reconstruction/surface_io.h"
#include "simulation/embedding.h"
#include "warp/carry_points.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using diagnosis::TargetQuestion;
using diagnosis::TargetRegions;

/// Points of the imaged body.
struct Targets {
  std::vector<std::string> names;
  std::vector<Eigen::RowVector3d> places;

  void add(const std::string& name, const Eigen::RowVector3d& place) {
    std::string own = name.empty() ? "point" : name;
    for (int again = 2; std::find(names.begin(), names.end(), own) != names.end(); ++again)
      own = fmt::format("{} {}", name.empty() ? "point" : name, again);
    names.push_back(own), places.push_back(place);
  }
};

/// Centroid of the volume inside a closed surface.
Eigen::RowVector3d middle_of(const reconstruction::Surface& surface) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  double volume = 0;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    const double part = a.dot(b.cross(c)) / 6;
    volume += part;
    sum += part * (a + b + c) / 4;
  }
  return sum / volume;
}

bool has_scan(const Case& description) {
  return std::any_of(description.poses.begin(), description.poses.end(), [&](const Pose& pose) {
    return pose.surface.has_value() && pose.name != description.imaged_pose;
  });
}

class TargetsTool : public Tool {
 public:
  std::string name() const override { return "supine-targets"; }

  std::string summary() const override {
    return "Says where points of the imaged body lie in a pose and how sure that is: a 95 % ellipsoid from all that "
           "the scans leave open (moduli, place of the scan, gravity, breath, uneven tissue, the mesh, what nothing "
           "explains), the distance to the skin, and what would make the ellipsoid smaller. Where nothing was "
           "measured, by what the model believes.\n"
           "Writes POSE_landmarks.csv and POSE_landmarks.json. -o names their folder (default: targets beside the "
           "mesh).\n\n"
           "Examples:\n"
           "  supine-targets mycase mycase/out/mesh.vtu\n"
           "  supine-targets mycase mycase/out/mesh.vtu --points targets.mrk.json --draws 500\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option(
        "--model", model_file_,
        "the model to begin with, as calibrated or as a diagnosis left it; priors of what CASE/model.toml has "
        "free stand there (default: CASE/model.toml)");
    app.add_option("--points", points_,
                   "points in the image: .csv (name,x,y,z), .fcsv or .mrk.json of 3D Slicer (default: the landmarks of "
                   "the case and the middle of the tumour)")
        ->allow_extra_args(false);
    app.add_option("--pose", poses_, "pose to find them in; may be repeated (default: every pose but the imaged one)")
        ->allow_extra_args(false);
    app.add_option("--draws", draws_,
                   "hold the part of parameters and nuisances against that many draws through the whole chain")
        ->check(CLI::Range(2, 100000));
    app.add_option("--seed", seed_, "of the draws")->capture_default_str();
    app.add_option("--diagnosis", diagnosis_file_,
                   "diagnosis.json of the case: sets of effects are as likely as it says (default: as straight lines "
                   "at the fit have them)");
    app.add_flag(
        "--nothing-missing", nothing_missing_,
        "take it that the model lacks nothing: regions of a model that does lack something are then too small");
    app.add_flag("--no-other-meshes", no_other_meshes_,
                 "do not solve on other meshes: the error of the mesh is then a usual share of the way");
    app.add_flag("--no-further-scans", no_further_scans_, "do not weigh scans of further poses");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    run.input(case_folder_ / "case.toml");
    const Case description = read_case(case_folder_);
    if (nothing_missing_ && !diagnosis_file_.empty())
      throw InputError("--nothing-missing and --diagnosis contradict each other; give one of them");
    if (!diagnosis_file_.empty() && !has_scan(description))
      throw InputError(fmt::format("--diagnosis {}: no pose of the case has a scan, so there is nothing it can be of",
                                   diagnosis_file_.string()));
    if (!diagnosis_file_.empty()) {
      told_ = read_likely_sets(run.input(diagnosis_file_));
      check_is_of(description);
    }
    for (const std::string& pose : wanted(description)) run.output(table(pose));
    return has_scan(description) ? by_scan(run) : by_priors(run, description);
  }

 private:
  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() / "targets" : output; }
  fs::path table(const std::string& pose) const { return folder() / (pose + "_landmarks.csv"); }
  fs::path model() const { return model_file_.empty() ? case_folder_ / "model.toml" : model_file_; }

  /// A diagnosis of another body says nothing of this one.
  void check_is_of(const Case& description) const {
    std::vector<fs::path> files = {mesh_file_};
    for (const Pose& pose : description.poses)
      if (pose.surface) files.push_back(*pose.surface);
    for (const fs::path& file : files)
      if (made_from_another(diagnosis_file_, file))
        throw InputError(fmt::format("--diagnosis {}: was made from another {} than {}; diagnose this case again",
                                     diagnosis_file_.string(), file.filename().string(), file.string()));
  }

  std::vector<std::string> wanted(const Case& description) const {
    std::vector<std::string> names;
    for (const std::string& name : poses_) {
      if (description.pose(name).name == description.imaged_pose)
        throw InputError(fmt::format("--pose {}: that is the imaged pose, where points are as marked", name));
      names.push_back(name);
    }
    for (const Pose& pose : description.poses)
      if (poses_.empty() && pose.name != description.imaged_pose) names.push_back(pose.name);
    if (names.empty()) throw InputError("case.toml has no pose but the imaged one; add [pose.supine] with its gravity");
    return names;
  }

  Outcome by_scan(Run& run) {
    const CaseToDiagnose known = measure_to_diagnose(run, read_case_inputs(run, case_folder_, mesh_file_, model()));
    const auto& measured = known.measured;
    const Targets targets = read_targets(run, measured->description, measured->mesh);
    const diagnosis::Subject subject = known.subject();
    calibration::Evaluator evaluator(subject.scene, subject.start, diagnosis::accurate_enough());
    diagnosis::BaseFitOptions options;
    options.priors = case_priors(measured->description, {});
    options.priors.patchiness = known.patchiness;
    options.other_meshes = !no_other_meshes_;
    LiveProgress live(run, std::chrono::seconds(0));
    options.progress = [&live](const std::string& what) { live.show(what); };
    run.stage("fit");
    const diagnosis::BaseFit base =
        diagnosis::fit_base_model(evaluator, subject.given, subject.start, subject.noise_mm, subject.near, options);
    const diagnosis::MissingEffects missing = may_be_missing(run, live, evaluator, base, options.priors);
    for (const std::string& pose : wanted(measured->description)) {
      run.stage("regions " + pose);
      live.show("regions in " + pose);
      const TargetQuestion question =
          question_of(measured->description, measured->mesh, measured->anatomy, targets, pose);
      const TargetRegions regions = diagnosis::find_regions(question, evaluator, base, missing, options.priors);
      warn_of_unsettled(run, regions);
      warn_of_landmarks(run, regions, pose);
      write(run, question, regions, *base.parameters, &base.fit.prediction.solution);
    }
    return left_out_ ? Outcome::target_not_met : Outcome::done;
  }

  /// What the model may lack, by the scan, or by a diagnosis of it.
  diagnosis::MissingEffects may_be_missing(Run& run, LiveProgress& live, calibration::Evaluator& evaluator,
                                           const diagnosis::BaseFit& base, const diagnosis::Priors& priors) const {
    if (nothing_missing_) return {};
    run.stage("effects");
    live.show("effects that may be missing");
    diagnosis::MissingEffects missing = diagnosis::screen_effects(evaluator, base, priors);
    if (!told_) return missing;
    const auto unknown = diagnosis::weigh_as(*told_, base.parameters->base(), missing);
    if (!unknown.empty())
      throw InputError(fmt::format("{}: speaks of {}, which this body and its scans cannot have; is it of this case?",
                                   diagnosis_file_.string(), fmt::join(unknown, ", ")));
    return missing;
  }

  /// A fit that stopped on its way has its optimum elsewhere, where derivatives may be others.
  static void warn_of_unsettled(Run& run, const TargetRegions& regions) {
    constexpr double settled = 0.2;  // of a coordinate, about a fifth of a modulus
    const double off = regions.unsettled_by;
    if (off > settled)
      run.warn(
          fmt::format("the fit has not settled: a parameter would go on by {:.2g} of its logarithm. Regions are to "
                      "first order from where it stopped; start nearer with --model",
                      off));
  }

  /// Where measured landmarks lie otherwise than all else allows, so may everything between them.
  static void warn_of_landmarks(Run& run, const TargetRegions& regions, const std::string& pose) {
    constexpr double unlikely = 0.01;
    if (!regions.landmarks || regions.landmarks->agreement.p_value >= unlikely) return;
    run.warn(
        fmt::format("landmarks in {} lie where all else that is known does not have them (p = {:.2g}, bound {}): "
                    "regions there are too small. Either the landmarks are wrong or the model lacks something; "
                    "supine-diagnose asks what, and its model is given with --model",
                    pose, regions.landmarks->agreement.p_value, unlikely));
  }

  Outcome by_priors(Run& run, const Case& description) {
    simulation::Model given = read_model(run.input(model()));
    const auto mesh = meshing::read_imaged_mesh(run.input(mesh_file_), description.side);
    const auto anatomy = meshing::compute_anatomy(mesh, description.side, description.imaged_pose);
    if (!description.is_object()) check_weight(given, anatomy, model());
    given = with_population(run, description, given);
    const Targets targets = read_targets(run, description, mesh);
    diagnosis::Priors priors = case_priors(description, {});
    priors.patchiness = read_patchiness(model());
    const calibration::FreeParameters free(given);
    for (const std::string& pose : wanted(description)) {
      run.stage("regions " + pose);
      const TargetQuestion question = question_of(description, mesh, anatomy, targets, pose);
      write(run, question, diagnosis::find_regions(question, given, !nothing_missing_, priors), free, nullptr);
    }
    return left_out_ ? Outcome::target_not_met : Outcome::done;
  }

  TargetQuestion question_of(const Case& description, const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy,
                             const Targets& targets, const std::string& pose) const {
    TargetQuestion question{&mesh,
                            &anatomy,
                            {description.imaged_pose, description.imaged().gravity},
                            {pose, description.pose(pose).gravity},
                            targets.names,
                            Points(static_cast<Eigen::Index>(targets.places.size()), 3),
                            !no_further_scans_ && !description.is_object()};
    for (std::size_t p = 0; p < targets.places.size(); ++p)
      question.imaged.row(static_cast<Eigen::Index>(p)) = targets.places[p];
    return question;
  }

  void write(Run& run, const TargetQuestion& question, const TargetRegions& regions,
             const calibration::FreeParameters& free, const simulation::ChainSolution* near) const {
    const fs::path file = table(question.pose.name);
    write_regions(regions, run.output(file));
    run.figures(file) = regions_figures(question, regions);
    say_regions(run, question, regions);
    if (!draws_) return;
    run.stage("draws " + question.pose.name);
    const auto drawn = diagnosis::draw_places(question, free, regions, near, *draws_, seed_, [&](int number) {
      run.progress(fmt::format("draw {} of {}", number + 1, *draws_));
    });
    run.figures(file)["draws"] = draws_figures(question, drawn);
    say_draws(run, question, drawn);
  }

  Targets read_targets(Run& run, const Case& description, const meshing::TetMesh& mesh) {
    Targets all;
    std::string from = "the case";
    for (const fs::path& file : points_) {
      if (std::count(points_.begin(), points_.end(), file) > 1)
        throw InputError(fmt::format("--points {}: is given twice", file.string()));
      const warp::PointFile points(run.input(file), description.frame);
      for (std::size_t p = 0; p < points.names().size(); ++p)
        all.add(points.names()[p], points.points().row(static_cast<Eigen::Index>(p)));
      from = file.string();
    }
    if (points_.empty()) add_of_case(run, description, mesh, all);
    if (all.names.empty())
      throw InputError(
          fmt::format("{}: names no landmarks and has no tumour: nothing to find; name points with --points",
                      (case_folder_ / "case.toml").string()));
    return inside(run, mesh, all, from);
  }

  void add_of_case(Run& run, const Case& description, const meshing::TetMesh& mesh, Targets& all) const {
    const auto tumour = static_cast<int>(segmentation::Tissue::tumour);
    const fs::path surface = mesh_file_.parent_path() / "tumour.vtp";
    if (mesh.fraction.col(tumour).sum() > 0 && fs::exists(surface))
      all.add("tumour", middle_of(reconstruction::read_surface(run.input(surface))));
    if (!description.prone_landmarks) return;
    const Landmarks marks = read_landmarks(run.input(*description.prone_landmarks), description.frame);
    for (std::size_t p = 0; p < marks.names.size(); ++p)
      all.add(marks.names[p], marks.points.row(static_cast<Eigen::Index>(p)));
  }

  /// Without those outside the body, which are told.
  Targets inside(Run& run, const meshing::TetMesh& mesh, const Targets& all, const std::string& from) {
    Points places(static_cast<Eigen::Index>(all.places.size()), 3);
    for (std::size_t p = 0; p < all.places.size(); ++p) places.row(static_cast<Eigen::Index>(p)) = all.places[p];
    const double spread_mm = (places.colwise().maxCoeff() - places.colwise().minCoeff()).norm();
    constexpr double least_spread_mm = 0.5;
    if (places.rows() > 1 && spread_mm < least_spread_mm)
      throw InputError(
          fmt::format("{}: its {} points lie within {:.2g} mm of each other (bound {:g} mm). In metres? "
                      "Write mm",
                      from, places.rows(), spread_mm, least_spread_mm));
    const Eigen::VectorXd outside = simulation::Embedding(mesh, places).outside_mm();
    if (outside.minCoeff() > warp::on_surface_mm) {
      Points turned = places;
      turned.leftCols<2>() *= -1;
      const bool fits = simulation::Embedding(mesh, turned).outside_mm().minCoeff() <= warp::on_surface_mm;
      throw InputError(fmt::format(
          "{}: every point lies outside the body, the nearest by {:.1f} mm (bound {:g} mm). {}", from,
          outside.minCoeff(), warp::on_surface_mm,
          fits ? "With x and y negated one lies inside: the file says LPS and is RAS, or the other way round"
               : "Were they marked in this image, in mm?"));
    }
    Targets kept;
    for (std::size_t p = 0; p < all.names.size(); ++p) {
      const double off = outside[static_cast<Eigen::Index>(p)];
      if (off <= warp::on_surface_mm) {
        kept.names.push_back(all.names[p]), kept.places.push_back(all.places[p]);
        continue;
      }
      left_out_ = true;
      run.warn(fmt::format("{}: point '{}' lies {:.1f} mm outside the body (bound {:g} mm) and is left out", from,
                           all.names[p], off, warp::on_surface_mm));
    }
    return kept;
  }

  fs::path case_folder_, mesh_file_, model_file_, diagnosis_file_;
  std::vector<fs::path> points_;
  std::vector<std::string> poses_;
  std::optional<std::vector<diagnosis::LikelySet>> told_;  // by the diagnosis
  std::optional<int> draws_;
  unsigned seed_ = 1;
  bool no_other_meshes_ = false, no_further_scans_ = false, left_out_ = false, nothing_missing_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::TargetsTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
