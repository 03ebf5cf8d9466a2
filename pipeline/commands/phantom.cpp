// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/phantom.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/error.h"
#include "phantom/mri/anatomy.h"
#include "phantom/mri/series.h"
#include "pipeline/tool/tool.h"
#include "segmentation/formats/image_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const std::map<std::string, phantom::Population> populations = {{"benchmark", phantom::Population::benchmark},
                                                                {"volunteers", phantom::Population::volunteers}};

class PhantomTool : public Tool {
 public:
  std::string name() const override { return "supine-phantom"; }

  std::string summary() const override {
    return "Makes a case whose answer is known and kept elsewhere: a computed breast with one, some or no effects that "
           "the base model lacks.\n"
           "-o names the case folder; the answer is written beside it, answers/NAME.json, or where --answer says. The "
           "case folder tells nothing of the answer.\n\n"
           "Examples:\n"
           "  supine-phantom --effect ligament --seed 7 -o trials/case-007\n"
           "  supine-phantom --effect null --tilt -o trials/case-008\n"
           "  supine-phantom --realistic --effect ligament --effect adhesion --seed 3 -o trials/case-010\n"
           "  supine-phantom --prior --seed 4 --tilt -o trials/case-011\n"
           "  supine-phantom --mri fatsat --seed 5 -o trials/mri-005\n"
           "  supine-phantom --mri t1 --seed 5 --gland breastphantom_fatty_0p5mm.nrrd -o trials/mri-006\n"
           "  supine-phantom --outside coil_contact --seed 9 -o trials/case-009 --answer sealed/9.json\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("--effect", effects_,
                   "an effect of the catalogue (supine-model list), or null; up to two, three with --realistic");
    app.add_option("--outside", options_.outside,
                   fmt::format("a cause that is not in the catalogue: {}", fmt::join(phantom::outside_causes(), ", ")));
    app.add_option("--size", options_.size, "of every cause: 0 to 1 in the range it has; default: drawn");
    app.add_option("--population", population_,
                   "whose breasts: benchmark, or volunteers, whose nipples move three times as far")
        ->check(CLI::IsMember({"benchmark", "volunteers"}))
        ->capture_default_str();
    app.add_flag(
        "--realistic", options_.realistic,
        "with what patients bring and no model has: patchy tissue and skin, a muscle that lies elsewhere, mild "
        "stiffening, shared scan error, and nuisances such as the place of the scans");
    app.add_flag(
        "--prior", options_.prior,
        "effects, nuisances and what no effect explains drawn from their priors; excludes --effect, --outside, "
        "--size and --realistic");
    app.add_option("--seed", options_.seed, "of body, sizes, noise and holes")
        ->check(not_below_zero())
        ->capture_default_str();
    app.add_flag("--tilt", options_.tilt, "also a scan of the body tilted by 45 degrees");
    app.add_option("--noise-mm", options_.noise_mm, "scanner noise along the normal, 1 sigma, 0 to 5")
        ->capture_default_str();
    voxel_ = app.add_option("--voxel-mm", options_.voxel_mm,
                            "of the labels, 0.5 to 4; with --mri across the body, default drawn")
                 ->capture_default_str();
    app.add_option("--slice-mm", slice_mm_, "with --mri and --voxel-mm: of the voxels along the body, 0.5 to 6");
    app.add_option("--rings", options_.rings, "fineness of the truth's mesh: rings of triangles on the skin, 4 to 30")
        ->capture_default_str();
    app.add_option("--order", options_.order, "of the truth's elements: 1 linear, 2 quadratic")->capture_default_str();
    app.add_option("--mri", series_,
                   "instead: a made MRI series of a drawn torso with both breasts: t1, fatsat, t2 (with fat "
                   "suppression); the answer is a label volume, answers/NAME.nrrd")
        ->check(CLI::IsMember({"t1", "fatsat", "t2"}));
    app.add_option("--gland", gland_,
                   "with --mri: a labelled breast (breastPhantom, x from chest to nipple) whose gland, vessels and "
                   "ligaments both breasts carry; default: drawn");
    app.add_option("--answer", answer_, "file of the answer, outside the case folder (.json)");
  }

  Outcome run(Run& run) override {
    const fs::path folder = case_folder();
    if (!series_.empty()) return make_series(folder, run);
    if (slice_mm_ != 0) throw InputError("--slice-mm goes with --mri: the labels of computed breasts have cubes");
    if (!gland_.empty()) throw InputError("--gland goes with --mri: computed breasts have a gland of their own");
    const fs::path answer = answer_file(folder);
    take_effects();
    options_.population = populations.at(population_);
    // Known at once, not after the work.
    for (const fs::path& file : {folder / "case.toml", answer})
      if (!run.force() && fs::exists(file))
        throw InputError(
            fmt::format("output file {} exists; add --force to replace it or choose another with -o", file.string()));
    run.stage("make");
    const phantom::Phantom phantom = phantom::make_phantom(options_);
    run.stage("write");
    Outputs outputs(run.force());
    phantom::write_case_folder(folder, phantom.contents, outputs);
    run.output(answer);
    run.figures(answer) = figures(folder, phantom);
    outputs.commit();
    run.say(fmt::format("{}: {} side, {:.0f} ml; the answer is in {}", folder.string(), phantom.body.side,
                        phantom.volume_ml, answer.string()));
    return Outcome::done;
  }

 private:
  Outcome make_series(const fs::path& folder, Run& run) {
    if (!effects_.empty() || !options_.outside.empty() || options_.prior || options_.realistic || options_.tilt ||
        !answer_.empty())
      throw InputError(
          "--mri makes a series of a drawn torso, which has no effects, poses or scans: only --seed, --gland and -o go "
          "with it");
    const auto series = series_ == "t1"   ? phantom::Series::t1
                        : series_ == "t2" ? phantom::Series::t2
                                          : phantom::Series::fatsat;
    const fs::path truth = folder.parent_path() / "answers" / (folder.filename().string() + ".nrrd");
    const Eigen::Vector3d voxel_mm = series_voxel_mm();
    run.stage("make");
    run.progress("drawing the torso and its series");
    phantom::Torso torso(options_.seed);
    if (!gland_.empty()) torso.carry(read_anatomy(run));
    const phantom::MadeSeries made =
        phantom::make_series(torso, options_.seed, {.series = series, .voxel_mm = voxel_mm});
    run.stage("write");
    Outputs outputs(run.force());
    phantom::write_series_folder(folder, truth, made, series, outputs);
    outputs.commit();
    const Eigen::Vector3i& size = made.image.grid.size;
    run.say(fmt::format("{}: {} x {} x {} voxels; what it was made of is in {}", folder.string(), size.x(), size.y(),
                        size.z(), truth.string()));
    return Outcome::done;
  }

  /// Zero where they are drawn.
  Eigen::Vector3d series_voxel_mm() const {
    if (voxel_->count() == 0 && slice_mm_ == 0) return Eigen::Vector3d::Zero();
    constexpr double least = 0.5, most_across = 4, most_along = 6;
    if (voxel_->count() == 0 || slice_mm_ == 0)
      throw InputError("with --mri --voxel-mm and --slice-mm go together: give both, or neither to have them drawn");
    const double across = options_.voxel_mm;
    if (!(across >= least && across <= most_across) || !(slice_mm_ >= least && slice_mm_ <= most_along))
      throw InputError(
          fmt::format("voxels of {:g} x {:g} x {:g} mm: --voxel-mm must lie in [{}, {}], --slice-mm in "
                      "[{}, {}]",
                      across, across, slice_mm_, least, most_across, least, most_along));
    return {across, across, slice_mm_};
  }

  std::shared_ptr<const phantom::Anatomy> read_anatomy(Run& run) const {
    try {
      // Its axes are its own: no frame says where its chest is.
      return std::make_shared<phantom::Anatomy>(segmentation::read_image(run.input(gland_), "LPS").image);
    } catch (const InputError& error) {
      throw InputError(fmt::format("--gland {}: {}", gland_.string(), error.what()));
    }
  }

  fs::path case_folder() const {
    if (output.empty()) throw InputError("name the case folder to make with -o");
    return fs::absolute(output / "").lexically_normal().parent_path();
  }

  fs::path answer_file(const fs::path& folder) const {
    const fs::path file = answer_.empty() ? folder.parent_path() / "answers" / (folder.filename().string() + ".json")
                                          : fs::absolute(answer_).lexically_normal();
    if (file.extension() != ".json") throw InputError(fmt::format("--answer {}: it must end in .json", file.string()));
    const fs::path inside = file.lexically_relative(folder);
    if (!inside.empty() && *inside.begin() != "..")
      throw InputError(
          fmt::format("--answer {} lies in the case folder {}: whoever reads the case would read the "
                      "answer; name a place outside",
                      file.string(), folder.string()));
    return file;
  }

  void take_effects() {
    if (options_.prior && !effects_.empty())
      throw InputError(
          "--prior excludes --effect: it draws number, names and sizes of the effects itself; leave one of "
          "them out");
    bool none = false;
    for (const std::string& effect : effects_) {
      none = none || effect == "null";
      if (effect != "null") options_.effects.push_back(effect);
    }
    if (none && !(options_.effects.empty() && options_.outside.empty()))
      throw InputError("--effect null means no cause at all; leave it out or leave the others out");
  }

  Json cause_figures(const phantom::Cause& cause) const {
    Json figures{{"name", cause.name}, {"outside", cause.outside}};
    figures["parameters"] = cause.values;
    figures["place"] = cause.place;
    if (options_.realistic || options_.prior) figures["nuisance_sigma"] = phantom::nuisance_sigma(cause.name);
    return figures;
  }

  static Json vector_figures(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

  static Json nuisance_figures(const phantom::Phantom& phantom) {
    const phantom::Nuisances& nuisances = *phantom.nuisances;
    Json figures{{"width", nuisances.width()}};
    for (const auto& [name, value] : nuisances.numbers()) figures[name] = value;
    for (const phantom::MeasuredPose& pose : phantom.contents.poses)
      figures["poses"][pose.name] = nuisances.numbers_of(pose.name);
    for (const auto& [name, size] : nuisances.field_sizes())
      figures["fields"][name] = {{"sd", size.sd}, {"length_mm", size.length_mm}};
    return figures;
  }

  static Json discrepancy_figures(const phantom::Phantom& phantom) {
    Json figures{{"size_mm", phantom.discrepancy->size_mm()}};
    for (const phantom::MeasuredPose& pose : phantom.contents.poses)
      figures["rms_mm"][pose.name] = phantom.discrepancy->rms_mm(pose.name);
    return figures;
  }

  /// What cases with nuisances have beside the rest.
  void add_nuisances(const phantom::Phantom& phantom, Json& f) const {
    f["drawn"] = options_.prior ? "prior" : "realistic";
    f["nuisances"] = nuisance_figures(phantom);
    for (const auto& [pose, place] : phantom.places)
      f["scan_place"][pose] = {{"shift_mm", vector_figures(place.shift_mm)},
                               {"turn_rad", vector_figures(place.turn_rad)}};
    f["neither_right_nor_wrong"] = phantom.nuisances->look_like();
    if (phantom.discrepancy) f["discrepancy"] = discrepancy_figures(phantom);
  }

  /// What breasts of volunteers are drawn for.
  static Json motion_figures(const phantom::Motion& motion) {
    Json figures{{"nipple_mm", vector_figures(motion.nipple_mm)}, {"nipple_moved_mm", motion.nipple_mm.norm()}};
    for (const phantom::InnerPlace& place : motion.inside)
      figures["inside"].push_back({{"moved_mm", place.moved_mm},
                                   {"from_nipple_mm", place.from_nipple_mm},
                                   {"muscle_mm", place.muscle_mm},
                                   {"skin_mm", place.skin_mm}});
    return figures;
  }

  /// Where points inside lie, for who wants to know how well they are found.
  static Json targets_figures(const phantom::Motion& motion) {
    Json list = Json::array();
    const Eigen::Index last = motion.prone.rows() - 1;
    for (Eigen::Index i = 0; i <= last; ++i)
      list.push_back({{"name", i == last ? std::string("tumour") : fmt::format("inside {}", i + 1)},
                      {"prone_mm", vector_figures(motion.prone.row(i).transpose())},
                      {"supine_mm", vector_figures(motion.supine.row(i).transpose())}});
    return list;
  }

  void add_population(const phantom::Phantom& phantom, Json& f) const {
    f["population"] = population_;
    f["gave_way"] = phantom.gave_way;
    f["motion"] = motion_figures(phantom.motion);
    f["motion"]["nipple_drawn_mm"] = phantom.body.nipple_moves_mm;
  }

  Json figures(const fs::path& folder, const phantom::Phantom& phantom) const {
    Json f;
    f["case"] = folder.filename().string();
    f["seed"] = options_.seed;
    f["causes"] = Json::array();
    for (const phantom::Cause& cause : phantom.causes) f["causes"].push_back(cause_figures(cause));
    if (options_.size) f["size"] = *options_.size;
    if (options_.population != phantom::Population::benchmark) add_population(phantom, f);
    if (phantom.nuisances) add_nuisances(phantom, f);
    f["base"] = {{"breast.young_modulus_kpa", phantom.body.breast_kpa},
                 {"skin.young_modulus_kpa", phantom.body.skin_kpa}};
    f["targets"] = targets_figures(phantom.motion);
    f["side"] = phantom.body.side;
    f["geometry"] = phantom.body.numbers();
    f["volume_ml"] = phantom.volume_ml;
    f["order"] = options_.order;
    f["nodes"] = phantom.nodes;
    f["tetrahedra"] = phantom.tetrahedra;
    for (const phantom::TruthPose& pose : phantom.poses) {
      const Eigen::VectorXd moved = (pose.x - phantom.rest).rowwise().norm();
      f["moved_from_rest_mm"][pose.name] = {{"rms", std::sqrt(moved.squaredNorm() / static_cast<double>(moved.size()))},
                                            {"max", moved.maxCoeff()}};
    }
    return f;
  }

  phantom::PhantomOptions options_;
  std::string population_ = "benchmark", series_;
  CLI::Option* voxel_ = nullptr;
  double slice_mm_ = 0;  // 0: drawn
  std::vector<std::string> effects_;
  fs::path answer_, gland_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::PhantomTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
