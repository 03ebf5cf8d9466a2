// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/fuzz/targets.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "calibration/run_journal.h"
#include "cohort/results.h"
#include "common/error.h"
#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/results/sensitivity_table.h"
#include "reconstruction/surface_io.h"
#include "registration/transform_file.h"
#include "segmentation/formats/dicom_io.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/formats/labels_io.h"
#include "segmentation/steps/recipe_toml.h"
#include "simulation/parameters.h"
#include "warp/point_file.h"

namespace supine::fuzz {
namespace {

namespace fs = std::filesystem;

Target image(const std::string& name, const std::string& file) {
  return {name, {file}, [file](const fs::path& folder) { segmentation::read_image(folder / file, "LPS"); }};
}

Target surface(const std::string& name) {
  return {name, {"surface." + name}, [name](const fs::path& folder) {
            reconstruction::read_surface(folder / ("surface." + name));
          }};
}

Target points(const std::string& name, const std::string& file) {
  return {name, {file}, [file](const fs::path& folder) { warp::PointFile(folder / file, "LPS"); }};
}

/// A part of a label file is read four times, by four readers.
void read_label_file(const fs::path& folder) {
  segmentation::read_labels(folder / "labels.vti");
  segmentation::read_gland_share(folder / "labels.vti");
  segmentation::read_label_supports(folder / "labels.vti");
  segmentation::read_label_notes(folder / "labels.vti");
}

void read_mesh_file(const fs::path& folder) {
  try {
    meshing::read_side(folder / "mesh.vtu");
    meshing::read_mesh(folder / "mesh.vtu");
  } catch (const InputError&) {
    meshing::read_pose(folder / "mesh.vtu");
  }
}

void read_case_file(const fs::path& folder) {
  for (const char* beside : {"labels.nrrd", "supine.ply", "tilt45.ply", "prone.csv", "supine.csv", "cohort.json"})
    std::ofstream(folder / beside) << beside;  // they only have to be there, and to differ
  pipeline::read_case(folder);
}

void read_model_file(const fs::path& folder) {
  const fs::path file = folder / "model.toml";
  pipeline::read_model(file);
  pipeline::read_patchiness(file);
  pipeline::with_effect(pipeline::read_model_text(file), "creep");
  pipeline::without_effect(pipeline::read_model_text(file), "ligament");
}

void read_population(const fs::path& folder) {
  pipeline::Run run("fuzz", true, true, false, 1, nlohmann::ordered_json::object());
  pipeline::Case description;
  description.folder = folder / "P001";
  description.cohort = folder / "cohort.json";
  simulation::Model model;
  simulation::base_setting(model, "breast.young_modulus_kpa").free = true;
  pipeline::with_population(run, description, model);
}

void read_cohort(const fs::path& folder) {
  std::ofstream(folder / "P001" / "case.toml") << "\n";
  const auto cases = cohort::read_results(folder, {});
  cohort::pooled(cases, {});
  cohort::table_csv(cases);
}

void read_journal(const fs::path& folder) {
  calibration::RunJournal journal(folder / "runs.journal", "key");
  journal.find(Eigen::Vector2d(1, 2));
}

/// A folder that goes away with the object.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "supine-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder " + name);
    path_ = name;
  }
  ~Folder() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> all = {
      image("nrrd", "volume.nrrd"),
      image("metaimage", "volume.mha"),
      image("nifti", "volume.nii"),
      image("nifti_gz", "volume.nii.gz"),
      {"vti", {"labels.vti"}, read_label_file},
      {"dicom",
       {"series/1.dcm", "series/2.dcm"},
       [](const fs::path& f) { segmentation::read_dicom(f / "series", ""); }},
      surface("ply"),
      surface("stl"),
      surface("obj"),
      surface("vtp"),
      {"vtu", {"mesh.vtu"}, read_mesh_file},
      {"case_toml", {"case.toml"}, read_case_file},
      {"model_toml", {"model.toml"}, read_model_file},
      {"recipe_toml", {"recipe.toml"}, [](const fs::path& f) { segmentation::read_recipe_file(f / "recipe.toml"); }},
      {"landmarks", {"points.csv"}, [](const fs::path& f) { read_landmarks(f / "points.csv", "RAS"); }},
      points("fcsv", "points.fcsv"),
      points("markups", "points.mrk.json"),
      {"tfm", {"place.tfm"}, [](const fs::path& f) { registration::read_tfm(f / "place.tfm"); }},
      {"sensitivity",
       {"sensitivity.csv"},
       [](const fs::path& f) { pipeline::read_sensitivity(f / "sensitivity.csv", {"breast.young_modulus_kpa"}); }},
      {"journal", {"runs.journal"}, read_journal},
      {"population", {"cohort.json"}, read_population},
      {"cohort", {"P001/out/diagnosis.json", "P001/out/calibration.json", "P001/out/comparison.json"}, read_cohort}};
  return all;
}

const Target& target_of(const std::string& name) {
  const auto found =
      std::find_if(targets().begin(), targets().end(), [&name](const Target& one) { return one.name == name; });
  if (found != targets().end()) return *found;
  std::string known;
  for (const Target& one : targets()) known += " " + one.name;
  throw InputError(fmt::format("there is no reader \"{}\"; known are{}", name, known));
}

std::string joined(const std::vector<std::string>& parts) {
  return fmt::format("{}", fmt::join(parts, std::string(separator)));
}

void read_input(const Target& target, std::string_view input) {
  const Folder folder;
  for (const std::string& name : target.files) {
    const auto end = target.files.size() == 1 ? std::string_view::npos : input.find(separator);
    const std::string_view part = input.substr(0, end);
    const fs::path file = folder.path() / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary).write(part.data(), static_cast<std::streamsize>(part.size()));
    if (end == std::string_view::npos) break;
    input.remove_prefix(end + separator.size());
  }
  try {
    target.read(folder.path());
  } catch (const InputError&) {
    // refused, which is an answer
  }
}

}  // namespace supine::fuzz
