// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "pipeline/case/case_volume.h"
#include "pipeline/case/two_poses.h"
#include "pipeline/case/volume_checks.h"
#include "pipeline/tool/lineage.h"
#include "pipeline/tool/tool.h"
#include "warp/carry_points.h"
#include "warp/displacement.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using segmentation::Grid;
using warp::Interpolation;

const std::map<std::string, Interpolation> interpolations = {
    {"nearest", Interpolation::nearest}, {"linear", Interpolation::linear}, {"bspline", Interpolation::bspline}};

/// One volume to be carried.
struct VolumeFile {
  fs::path file;
  bool labels;
};

/// One file of points, and the name of its result without pose and ending.
struct NamedPoints {
  fs::path file;
  std::string stem;
};

/// What is to be carried.
struct Cargo {
  std::vector<VolumeFile> volumes;
  std::vector<NamedPoints> points;
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Name without the extensions of volumes and points.
std::string stem_of(const fs::path& file) {
  std::string name = file.filename().empty() ? file.parent_path().filename().string() : file.filename().string();
  for (const char* end :
       {".nii.gz", ".seg.nrrd", ".mrk.json", ".nrrd", ".nhdr", ".mha", ".mhd", ".nii", ".vti", ".fcsv", ".csv"})
    if (lower(name).ends_with(end)) return name.substr(0, name.size() - std::string(end).size());
  return name;
}

bool named_labels(const fs::path& file) {
  const std::string name = lower(file.filename().string());
  return name.ends_with(".seg.nrrd") || name == "labels.vti";
}

class WarpTool : public Tool {
 public:
  std::string name() const override { return "supine-warp"; }

  std::string summary() const override {
    return "Carries volumes and points from one pose into another: the MRI, labels, targets, planned paths into the "
           "supine shape, or a supine ultrasound or CT back onto the MRI.\n"
           "Writes TO_NAME.nrrd for each volume, TO_NAME with the ending of the points, and the displacement between "
           "the two shapes, TO_from_FROM_displacement.nrrd, .nii.gz and TO_from_FROM.tfm (ITK, LPS, mm; target place → "
           "source place, as 3D Slicer takes it). -o names their folder (default: warp in the folder of the "
           "shapes).\n\n"
           "Examples:\n"
           "  supine-warp mycase --pose supine\n"
           "  supine-warp mycase pet.nii.gz --labels lesions.seg.nrrd --spacing 1 --trust-place\n"
           "  supine-warp mycase ultrasound.nrrd --from supine --to prone --like mycase/mri.nrrd --trust-place\n"
           "  supine-warp mycase --points targets.mrk.json --points incision.fcsv\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("volumes", volumes_,
                   "volumes to carry, in the pose --from (default, without --points and --labels: the case's image, "
                   "labels.vti and prone landmarks)");
    app.add_option("--labels", labels_, "volumes of labels: the nearest value is taken")->allow_extra_args(false);
    app.add_option("--points", points_, "points to carry: .csv (name,x,y,z), .fcsv or .mrk.json of 3D Slicer")
        ->allow_extra_args(false);
    auto* pose = app.add_option("--pose", to_, "the same as --to");
    app.add_option("--from", from_,
                   "pose that the volumes show: prone, supine, undeformed, … (default: the imaged pose)");
    app.add_option("--to", to_, "pose they are carried into")->capture_default_str()->excludes(pose);
    app.add_option("--dir", shapes_, "folder of the shapes FROM.vtu and TO.vtu (default: CASE/out)");
    app.add_option("--like", like_,
                   "a volume whose grid the results get (default: that of each volume, grown to hold "
                   "the shape)");
    app.add_option("--spacing", spacing_mm_, "voxels of the results, mm, one number or three along the axes")
        ->expected(1, 3)
        ->check(above_zero());
    app.add_option("--interpolation", interpolation_, "of grey volumes: linear, nearest, bspline (cubic)")
        ->check(CLI::IsMember({"nearest", "linear", "bspline"}))
        ->capture_default_str();
    app.add_option("--blend", blend_mm_, "over how many mm what lies outside the body goes along with it")
        ->check(within(0, 200))
        ->capture_default_str();
    constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
    app.add_option("--background", background_,
                   "value where there is nothing to show (default: the volume's least; of labels 0)")
        ->check(within(-largest, largest));
    app.add_option("--grid-mm", grid_mm_,
                   "spacing of the displacement's grid, mm (default: so that it has about 400,000 points)")
        ->check(within(1e-3, 50));
    app.add_flag("--trust-place", trust_place_,
                 "carry grey volumes that hold less than half of the body or do not show its skin (an ultrasound, a "
                 "PET): where they lie is not checked");
    app.add_flag("--no-transform", no_transform_, "write no displacement and no transform");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    run.input(case_folder_ / "case.toml");
    const Case measured = read_case(case_folder_);
    if (shapes_.empty()) shapes_ = case_folder_ / "out";
    if (from_.empty()) from_ = measured.imaged_pose;
    const TwoPoses poses = read_two_poses(run, measured, shapes_, from_, to_);
    const bool chosen = !volumes_.empty() || !labels_.empty() || !points_.empty();
    const Cargo cargo = chosen ? chosen_cargo() : case_cargo(run, measured);
    check_names(cargo);
    bool all_carried = true;
    for (const VolumeFile& volume : cargo.volumes) carry_volume(run, measured, poses, volume);
    run.stage("points");
    for (const NamedPoints& points : cargo.points) all_carried = carry(run, measured, poses, points) && all_carried;
    if (!no_transform_ && !cargo.volumes.empty()) write_displacement(run, poses);
    return all_carried ? Outcome::done : Outcome::target_not_met;
  }

 private:
  fs::path folder() const { return output.empty() ? shapes_ / "warp" : output; }

  Cargo chosen_cargo() const {
    Cargo cargo;
    for (const fs::path& file : volumes_) cargo.volumes.push_back({file, named_labels(file)});
    for (const fs::path& file : labels_) cargo.volumes.push_back({file, true});
    for (const fs::path& file : points_) cargo.points.push_back({file, stem_of(file)});
    return cargo;
  }

  /// What the case itself has in the pose.
  Cargo case_cargo(Run& run, const Case& measured) const {
    if (from_ != measured.imaged_pose)
      throw InputError(
          fmt::format("the case's own image shows {}; name the volume that shows {}, or points with --points",
                      measured.imaged_pose, from_));
    Cargo cargo;
    for (const fs::path& place : {shapes_, shapes_.parent_path(), case_folder_ / "out"})
      if (const fs::path labels = place / "labels.vti"; cargo.volumes.empty() && fs::exists(labels)) {
        cargo.volumes.push_back({labels, true});
        if (made_from_another(place / "mesh.vtu", labels))
          run.warn(fmt::format("{} is another one than mesh.vtu beside it was made from: are they of the same body?",
                               labels.string()));
      }
    const bool grey = measured.image_kind == "mri";
    if (grey || (cargo.volumes.empty() && measured.image_kind == "labels"))
      cargo.volumes.insert(cargo.volumes.begin(), {measured.image_file, !grey});
    if (measured.prone_landmarks) cargo.points.push_back({*measured.prone_landmarks, "landmarks"});
    return cargo;
  }

  static void check_names(const Cargo& cargo) {
    std::map<std::string, fs::path> names;
    const auto claim = [&names](const std::string& name, const fs::path& file) {
      if (const auto [known, is_new] = names.emplace(name, file); !is_new)
        throw InputError(
            fmt::format("{} and {} would get the same name, …{}; carry one of them into another folder (-o)",
                        known->second.string(), file.string(), name));
    };
    for (const VolumeFile& volume : cargo.volumes) claim(stem_of(volume.file) + ".nrrd", volume.file);
    for (const NamedPoints& points : cargo.points) claim(points.stem + "_points", points.file);
  }

  void carry_volume(Run& run, const Case& measured, const TwoPoses& poses, const VolumeFile& volume) const {
    const fs::path target = folder() / (poses.to + "_" + stem_of(volume.file) + ".nrrd");
    const fs::path staged = run.output(target);
    run.stage("read " + stem_of(volume.file));
    const segmentation::ImageFile file = read_case_volume(run, measured, volume.file);
    const auto& image = file.image;
    check_holds_body(run, poses, image.grid, volume.file.string(), trust_place_);
    const Grid grid = target_grid(run, measured, image.grid, poses.target);
    warp::WarpOptions options;
    options.interpolation = volume.labels ? Interpolation::nearest : interpolations.at(interpolation_);
    options.blend_mm = blend_mm_;
    options.background = background_ ? *background_ : volume.labels ? std::optional<float>(0.0F) : std::nullopt;
    options.progress = [&run](double share) { run.progress(fmt::format("carrying: {:.0f} %", 100 * share)); };
    // The result, its bytes as stored, and what is kept of the source for every voxel of it.
    warp::check_memory(grid, 2.5 * sizeof(float));
    run.stage("carry " + stem_of(volume.file));
    const double contrast = volume.labels ? 1 : check_shows_skin(run, poses, image, volume.file.string(), trust_place_);
    const warp::WarpedVolume carried = warp::warp_volume(poses.shapes(), image, grid, options);
    check_body_is_there(target, carried);
    run.stage("write " + stem_of(volume.file));
    run.progress("writing");
    segmentation::write_image(carried.image, staged);
    fill(run.figures(target), poses, carried, volume, contrast);
    tell(run, target, carried);
  }

  Grid target_grid(Run& run, const Case& measured, const Grid& source, const Points& shape) const {
    if (spacing_mm_.size() == 2) throw InputError("--spacing takes one number, or three for the axes i, j, k");
    constexpr double margin_mm = 5;
    Grid grid = like_.empty() ? warp::grown_to_hold(source, shape, margin_mm)
                              : read_case_volume(run, measured, like_).image.grid;
    if (spacing_mm_.empty()) return grid;
    const bool one = spacing_mm_.size() == 1;
    return warp::with_spacing(grid, {spacing_mm_[0], spacing_mm_[one ? 0 : 1], spacing_mm_[one ? 0 : 2]});
  }

  static Json grid_json(const Grid& grid) {
    const auto list = [](const auto& v) { return Json(std::vector<double>(v.begin(), v.end())); };
    return {{"size", std::vector<int>(grid.size.begin(), grid.size.end())},
            {"spacing_mm", list(grid.spacing_mm)},
            {"origin_mm", list(grid.origin_mm)}};
  }

  void fill(Json& f, const TwoPoses& poses, const warp::WarpedVolume& carried, const VolumeFile& volume,
            double contrast) const {
    f["from"] = poses.from;
    f["to"] = poses.to;
    f["interpolation"] = volume.labels ? "nearest" : interpolation_;
    f["grid"] = grid_json(carried.image.grid);
    f["body_ml"] = 1e-3 * carried.image.grid.voxel_volume_mm3() * static_cast<double>(carried.body_voxels);
    f["body_voxels"] = carried.body_voxels;
    f["unseen_voxels"] = carried.unseen_voxels;
    f["left_voxels"] = carried.left_voxels;
    f["overlapping_voxels"] = carried.overlap.voxels;
    if (!volume.labels) f["skin_contrast"] = contrast;
  }

  static void tell(Run& run, const fs::path& target, const warp::WarpedVolume& carried) {
    const Grid& grid = carried.image.grid;
    run.say(fmt::format("  {}: {} x {} x {} voxels of {:.3g} x {:.3g} x {:.3g} mm, {:.1f} ml of body", target.string(),
                        grid.size.x(), grid.size.y(), grid.size.z(), grid.spacing_mm.x(), grid.spacing_mm.y(),
                        grid.spacing_mm.z(),
                        1e-3 * grid.voxel_volume_mm3() * static_cast<double>(carried.body_voxels)));
    if (carried.unseen_voxels > 0)
      run.warn(
          fmt::format("{}: {:.1f} % of the body comes from beyond the volume and is background", target.string(),
                      100.0 * static_cast<double>(carried.unseen_voxels) / static_cast<double>(carried.body_voxels)));
    if (carried.overlap.voxels > 0) {
      const Eigen::Vector3d& at = carried.overlap.place_mm;
      run.warn(
          fmt::format("{}: the shape lies in itself over {} voxels (a fold), the first at ({:.1f}, {:.1f}, {:.1f}) "
                      "mm; the first cell is shown there",
                      target.string(), carried.overlap.voxels, at.x(), at.y(), at.z()));
    }
  }

  /// @return  whether every point was carried
  bool carry(Run& run, const Case& measured, const TwoPoses& poses, const NamedPoints& named) const {
    const fs::path& file = named.file;
    const warp::PointFile points(run.input(file), measured.frame);
    const warp::CarriedPoints carried =
        warp::carry_points(poses.shapes(), points.points(), points.groups(), file.string());
    const fs::path target = folder() / (poses.to + "_" + named.stem + points.extension());
    points.write(carried.places, run.bare_output(target));
    Json& f = run.figures(folder() / (poses.to + "_" + named.stem + "_points.json"));
    f["from"] = poses.from, f["to"] = poses.to, f["frame"] = points.frame();
    f["points"] = Json::array();
    for (std::size_t p = 0; p < points.names().size(); ++p) {
      const auto row = static_cast<Eigen::Index>(p);
      const auto at = carried.places.row(row);
      f["points"].push_back({{"name", points.names()[p]},
                             {"carried", static_cast<bool>(carried.was_carried[p])},
                             {"place_mm", {at.x(), at.y(), at.z()}},
                             {"moved_mm", (at - points.points().row(row)).norm()},
                             {"outside_mm", carried.outside_mm[row]}});
      if (!carried.was_carried[p])
        run.warn(fmt::format("{}: point '{}' lies {:.1f} mm outside the body (bound {:g} mm) and stays where it was",
                             file.string(), points.names()[p], carried.outside_mm[row], warp::on_surface_mm));
    }
    f["curves"] = Json::array();
    for (std::size_t g = 0; g < points.groups().size(); ++g)
      if (points.groups()[g].connected())
        f["curves"].push_back({{"name", points.groups()[g].name},
                               {"kind", points.groups()[g].kind},
                               {"between_points_mm", carried.between_mm[g]}});
    run.say(fmt::format("  {}: {} of {} points carried", target.string(), points.names().size() - carried.left_behind(),
                        points.names().size()));
    return carried.left_behind() == 0;
  }

  void write_displacement(Run& run, const TwoPoses& poses) const {
    run.stage("displacement");
    constexpr double usual_points = 4e5;
    const warp::TwoShapes shapes = poses.shapes();
    const double spacing = grid_mm_ ? *grid_mm_ : warp::spacing_for(shapes, usual_points);
    const warp::Displacement field = warp::displacement_of(shapes, spacing, blend_mm_);
    const std::string stem = poses.to + "_from_" + poses.from;
    for (const std::string end : {"_displacement.nrrd", "_displacement.nii.gz"})
      segmentation::write_vectors(field.image, run.output(folder() / (stem + end)));
    const fs::path transform = folder() / (stem + ".tfm");
    warp::write_tfm(field.image, run.output(transform));
    Json& f = run.figures(transform);
    f["from"] = poses.from, f["to"] = poses.to;
    f["maps"] = fmt::format("a place in {} to the place in {} it comes from", poses.to, poses.from);
    f["grid"] = grid_json(field.image.grid);
    f["grid_error_rms_mm"] = field.error_rms_mm, f["grid_error_max_mm"] = field.error_max_mm;
    run.say(
        fmt::format("  {}: {} -> {}, {} x {} x {} points every {:.2f} mm; between them {:.3f} mm rms, {:.2f} mm at "
                    "most from the model",
                    transform.string(), poses.to, poses.from, field.image.grid.size.x(), field.image.grid.size.y(),
                    field.image.grid.size.z(), spacing, field.error_rms_mm, field.error_max_mm));
  }

  fs::path case_folder_, shapes_, like_;
  std::vector<fs::path> volumes_, labels_, points_;
  std::string from_, to_ = "supine", interpolation_ = "linear";
  std::vector<double> spacing_mm_;
  double blend_mm_ = 10;
  std::optional<float> background_;
  std::optional<double> grid_mm_;
  bool no_transform_ = false, trust_place_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::WarpTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
