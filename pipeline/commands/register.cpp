// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <cmath>

#include "common/error.h"
#include "pipeline/case/scan_case.h"
#include "pipeline/picture/picture.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/surface_io.h"
#include "registration/register_scan.h"
#include "registration/transform_file.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using registration::Registration;
using registration::RigidTransform;
using Json = nlohmann::ordered_json;

const double degrees = 180 / std::acos(-1.0);

template <class Vector>
Json list(const Vector& values) {
  Json numbers = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) numbers.push_back(values[i]);
  return numbers;
}

template <class Matrix>
Json rows(const Matrix& values) {
  Json table = Json::array();
  for (Eigen::Index i = 0; i < values.rows(); ++i) table.push_back(list(values.row(i)));
  return table;
}

/// 1 sigma: mm, then degrees.
Eigen::Matrix<double, 6, 1> deviations(const Eigen::Matrix<double, 6, 6>& covariance) {
  Eigen::Matrix<double, 6, 1> sd = covariance.diagonal().cwiseSqrt();
  sd.tail<3>() *= degrees;
  return sd;
}

class RegisterTool : public Tool {
 public:
  std::string name() const override { return "supine-register"; }

  std::string summary() const override {
    return "Lays a scan of another frame on the body: finds the rigid transform scan → image, how well each of its six "
           "numbers is known, and where the shape does not fix it.\n"
           "By landmarks, then the skin that the model predicts in the pose, or the support ([register] in case.toml). "
           "Writes registration.tfm (ITK, LPS, mm; image → scan, as 3D Slicer takes it), registration.json, "
           "registered.vtp and registered_landmarks.csv; for a pose other than supine registration_POSE.tfm and so on. "
           "-o names their folder (default: that of the shape).\n\n"
           "Examples:\n"
           "  supine-register mycase\n"
           "  supine-register mycase --pose tilt45 --png mycase/out/placement.png\n"
           "  supine-register mycase --start by_hand.tfm -o mycase/out --force\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("--pose", pose_name_, "the pose whose scan is laid on the body")->capture_default_str();
    app.add_option("--shape", shape_,
                   "shape of the model in the pose, as supine-simulate writes it (default: CASE/out/POSE.vtu)");
    app.add_option("--start", start_file_,
                   "ITK transform (.tfm) of about where the scan lies, image → scan, for example by hand in 3D Slicer "
                   "(default: as given, or where the landmarks say)");
    declare_png(app, png_, "the scan on the body, as given and as found,");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    run.input(case_folder_ / "case.toml");
    const Case description = read_case(case_folder_);
    const Pose& pose = description.pose(pose_name_);
    if (shape_.empty()) shape_ = case_folder_ / "out" / (pose.name + ".vtu");
    const ScanCase in = read_scan_case(description, pose, shape_);
    for (const fs::path& file : in.read) run.input(file);
    const RigidTransform given =
        start_file_.empty() ? RigidTransform{} : registration::read_tfm(run.input(start_file_));
    announce_png(run, png_, target(pose, "registered", ".vtp"));
    run.stage("register");
    const Registration found =
        registration::register_scan(in.problem, given, pose.noise_mm.has_value(), pose.surface->string());
    run.stage("write");
    write(run, pose, in, found);
    if (!png_.empty()) draw(run, description, pose, in, found);
    say(run, pose, in, found);
    return doubt(run, found);
  }

 private:
  fs::path target(const Pose& pose, const std::string& stem, const std::string& end) const {
    const fs::path folder = output.empty() ? shape_.parent_path() : output;
    return folder / (stem + (pose.name == "supine" ? "" : "_" + pose.name) + end);
  }

  void write(Run& run, const Pose& pose, const ScanCase& in, const Registration& found) const {
    const fs::path transform = target(pose, "registration", ".tfm"), moved_file = target(pose, "registered", ".vtp");
    const RigidTransform& placement = found.fit.transform;
    registration::write_tfm(placement, found.fit.pivot, run.output(transform));
    fill(run.figures(transform), pose, in, found);
    reconstruction::Surface moved = in.scan;
    moved.points = placement.apply(in.scan.points);
    reconstruction::write_surface(moved, run.output(moved_file));
    run.figures(moved_file) = {
        {"pose", pose.name}, {"points", moved.points.rows()}, {"triangles", moved.triangles.rows()}};
    if (!in.landmarks) return;
    Landmarks landmarks = *in.landmarks;
    landmarks.points = placement.apply(landmarks.points);
    const fs::path landmark_file = target(pose, "registered", "_landmarks.csv");
    write_landmarks(landmarks, run.output(landmark_file));
    run.figures(landmark_file) = {{"pose", pose.name}, {"landmarks", landmarks.names.size()}};
  }

  static Json placement_of(const Registration& found, const Eigen::Vector3d& centre_given) {
    const RigidTransform& placement = found.fit.transform;
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = placement.rotation;
    matrix.topRightCorner<3, 1>() = placement.shift;
    registration::Motion motion = registration::motion_about(centre_given, placement);
    motion.tail<3>() *= degrees;
    const Eigen::Vector3d centre = placement.at(centre_given);
    const auto about_centre = registration::covariance_about(found.fit, centre);
    Json json;
    json["scan_to_image"] = rows(matrix);
    json["centre_mm"] = list(centre);
    json["shift_mm"] = list(motion.head<3>());
    json["turn_deg"] = list(motion.tail<3>());
    json["sd"] = list(deviations(about_centre));
    json["registration_mm"] = std::sqrt(about_centre.topLeftCorner<3, 3>().trace() / 3);
    json["registration_deg"] = std::sqrt(about_centre.bottomRightCorner<3, 3>().trace() / 3) * degrees;
    json["pivot_mm"] = list(found.fit.pivot);
    json["covariance_mm_rad"] = rows(found.fit.covariance);
    json["weak"] = Json::array();
    for (const auto& weak : registration::weak_directions(found.fit))
      json["weak"].push_back({{"kind", weak.turn ? "turn" : "shift"},
                              {"axis", list(weak.axis)},
                              {weak.turn ? "sd_deg" : "sd_mm", weak.turn ? weak.sd * degrees : weak.sd}});
    return json;
  }

  static void fill(Json& figures, const Pose& pose, const ScanCase& in, const Registration& found) {
    figures = {{"pose", pose.name}, {"on", in.on}};
    figures.update(placement_of(found, in.scan.points.colwise().mean().transpose()));
    figures["overlap"] = found.overlap;
    figures["rms_before_mm"] = found.before_mm;
    figures["rms_after_mm"] = found.after_mm;
    figures["noise_mm"] = found.noise_mm;
    figures["misfit_mm"] = found.fit.misfit_mm;
    figures["misfit_length_mm"] = found.fit.misfit_length_mm;
    figures["effective_points"] = found.fit.effective_points;
    figures["softness"] = found.fit.softness;
    figures["softness_sd"] = found.fit.softness_sd;
    figures["other_places"] = found.other_places;
    figures["axes"] = found.axes;
    figures["given_inside_95"] = found.given_inside;
    figures["landmarks"] = Json::array();
    for (const auto& landmark : in.problem.landmarks)
      figures["landmarks"].push_back({{"name", landmark.name},
                                      {"rigid", landmark.rigid},
                                      {"error_mm", (found.fit.transform.at(landmark.scan) - landmark.image).norm()}});
  }

  void draw(Run& run, const Case& description, const Pose& pose, const ScanCase& in, const Registration& found) const {
    Placed placed{{in.skin->distance().points(), in.skin->triangles(), {}}, in.scan, in.scan};
    placed.after.points = found.fit.transform.apply(in.scan.points);
    placed.object = description.is_object();
    draw_placement(placed,
                   fmt::format("{}, {}: {:.2f} mm before, {:.2f} mm after (RMS)", description.name, pose.name,
                               found.before_mm, found.after_mm),
                   run.output(png_));
  }

  static void say(const Run& run, const Pose& pose, const ScanCase& in, const Registration& found) {
    const Json place = placement_of(found, in.scan.points.colwise().mean().transpose());
    run.say(fmt::format("{}: {} on {}", pose.name, pose.surface->filename().string(), fmt::join(in.on, ", ")));
    run.say(fmt::format("  {:<10}{:>10}{:>10}{:>10}", "", "x", "y", "z"));
    const auto row = [&](const char* what, const Json& values, std::size_t from) {
      run.say(fmt::format("  {:<10}{:>10.2f}{:>10.2f}{:>10.2f}", what, values[from].get<double>(),
                          values[from + 1].get<double>(), values[from + 2].get<double>()));
    };
    row("shift, mm", place["shift_mm"], 0);
    row("  ± 1 sd", place["sd"], 0);
    row("turn, deg", place["turn_deg"], 0);
    row("  ± 1 sd", place["sd"], 3);
    if (found.after_mm > 0)
      run.say(
          fmt::format("  {:.0f} % of the scan meets the body; RMS {:.2f} mm before, {:.2f} after; misfit of the body "
                      "{:.1f} mm over {:.0f} mm, {:.0f} independent points",
                      100 * found.overlap, found.before_mm, found.after_mm, found.fit.misfit_mm,
                      found.fit.misfit_length_mm, found.fit.effective_points));
    if (!in.problem.landmarks.empty())
      run.say(fmt::format("  landmarks {:.1f} mm off before, {:.1f} after (RMS)", found.landmarks_before_mm,
                          found.landmarks_after_mm));
    run.say(fmt::format("  for [pose.{}]: registration_mm = {:.2f}, registration_deg = {:.2f}", pose.name,
                        place["registration_mm"].get<double>(), place["registration_deg"].get<double>()));
  }

  static Outcome doubt(Run& run, const Registration& found) {
    if (!found.axes.empty()) run.warn(fmt::format("the scan's axes are not those of the image: {}", found.axes));
    if (found.searched_far)
      run.warn(
          "nothing fitted near where the scan was said to lie; found from many starts, without landmarks: look at it");
    if (found.other_places > 0)
      run.warn(fmt::format("{} other place{} fit nearly as well; the uncertainty includes them. Landmarks would tell",
                           found.other_places, found.other_places > 1 ? "s" : ""));
    for (const auto& weak : registration::weak_directions(found.fit))
      run.warn(fmt::format(
          "the {} {} ({:.2f}, {:.2f}, {:.2f}) is known to ± {:.1f} {} only (1 sd): the shape does not fix it",
          weak.turn ? "turn about" : "shift along", "the axis", weak.axis.x(), weak.axis.y(), weak.axis.z(),
          weak.turn ? weak.sd * degrees : weak.sd, weak.turn ? "degrees" : "mm"));
    if (!found.worse_than_given()) {
      if (found.given_inside)
        run.say("  the 95 % region holds the place as given as well: the scan does not say that it lies elsewhere");
      return Outcome::done;
    }
    const std::string figures =
        fmt::format("RMS {:.2f} mm before, {:.2f} after; landmarks {:.2f} before, {:.2f} after", found.before_mm,
                    found.after_mm, found.landmarks_before_mm, found.landmarks_after_mm);
    if (found.given_inside) {
      run.warn("the scan fitted as well where it was given, which the 95 % region holds; keep it there: " + figures);
      return Outcome::done;
    }
    run.warn("the scan lies no better than before: " + figures);
    return Outcome::target_not_met;
  }

  fs::path case_folder_, shape_, start_file_, png_;
  std::string pose_name_ = "supine";
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::RegisterTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
