// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case.h"

#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>

#include "common/error.h"
#include "common/suggestion.h"
#include "common/toml_reader.h"
#include "pipeline/case/case_image.h"
#include "segmentation/tissue.h"
#include "simulation/catalogue.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double unit_tolerance = 1e-3;  // of a gravity vector's length
constexpr double same_direction_rad = 1e-3;
constexpr const char* undeformed = "undeformed";  // as pose of an image: free of load
constexpr double most_noise_mm = 20;

/// Names of files that tools write; a pose of that name would overwrite them.
const std::vector<std::string> reserved_names = {"undeformed",  "mesh",   "labels",       "breast",     "muscle",
                                                 "gland",       "tumour", "coarse",       "comparison", "scan",
                                                 "calibration", "model",  "history",      "ladder",     "diagnosis",
                                                 "sensitivity", "report", "registration", "registered"};

Eigen::Vector3d read_gravity(const TomlReader& pose, const std::string& frame) {
  const auto given = pose.vector("gravity");
  if (!given) pose.fail("gravity", "is missing: give the direction in which things fall, as three numbers of length 1");
  const Eigen::Vector3d vector = *given;
  const double length = vector.norm();
  if (length == 0) return vector;  // buoyancy: read_poses() sees where that is meant
  if (std::abs(length - 1) > unit_tolerance) {
    const Eigen::Vector3d unit = vector / length;
    pose.fail(
        "gravity",
        fmt::format("is a direction and must have length 1 (within {}), not {:.6g}; write [{:.6f}, {:.6f}, {:.6f}]",
                    unit_tolerance, length, unit.x(), unit.y(), unit.z()));
  }
  const Eigen::Vector3d lps = frame == "RAS" ? Eigen::Vector3d(-vector.x(), -vector.y(), vector.z()) : vector;
  return lps / length;
}

/// Keys that say how well a measurement is known, and up to where they make sense.
struct KnownKey {
  std::string_view key;
  std::optional<double> Known::*member;
  double most;
};
constexpr KnownKey known_keys[] = {{"registration_mm", &Known::registration_mm, 50},
                                   {"registration_deg", &Known::registration_deg, 45},
                                   {"gravity_deg", &Known::gravity_deg, 45},
                                   {"breath_mm", &Known::breath_mm, 30},
                                   {"noise_shared_mm", &Known::noise_shared_mm, 10}};

Known read_known(const TomlReader& reader, const std::string& name, const std::string& imaged) {
  Known known;
  for (const KnownKey& row : known_keys) {
    const auto value = reader.number(row.key);
    if (!value) continue;
    if (name == imaged)
      reader.fail(row.key,
                  fmt::format("says how well another pose is known beside the image; leave it out of [pose.{}]", name));
    if (*value < 0 || *value > row.most)
      reader.fail(row.key, fmt::format("is 1 sigma and must lie in 0 to {:g}, not {:g}", row.most, *value));
    known.*row.member = value;
  }
  return known;
}

std::optional<double> read_independent_points(const TomlReader& reader, const Pose& pose) {
  constexpr double fewest = 10;
  const auto points = reader.number("independent_points");
  if (points && !(*points >= fewest))
    reader.fail("independent_points", fmt::format("must be at least {:g}, not {:g}", fewest, *points));
  if (points && !pose.noise_mm)
    reader.fail("independent_points",
                "needs noise_mm beside it: what points that repeat each other err cannot be seen between neighbours");
  return points;
}

Pose read_pose(const TomlReader& reader, const std::string& name, const Case& result) {
  std::vector<std::string> keys = {"gravity", "surface", "noise_mm", "independent_points", "landmarks"};
  for (const KnownKey& row : known_keys) keys.emplace_back(row.key);
  reader.allow(keys);
  Pose pose;
  pose.name = name;
  pose.gravity = read_gravity(reader, result.frame);
  if (reader.has("surface")) pose.surface = case_path(reader, "surface", false);
  if (reader.has("landmarks")) pose.landmarks = case_path(reader, "landmarks", false);
  pose.noise_mm = reader.number("noise_mm");
  if (pose.noise_mm && *pose.noise_mm <= 0)
    reader.fail("noise_mm", "must be > 0 mm; leave the key out when the noise is not known");
  if (pose.noise_mm && *pose.noise_mm > most_noise_mm)
    reader.fail("noise_mm", fmt::format("must be at most {:g} mm, not {:g}; was it meant in micrometres?",
                                        most_noise_mm, *pose.noise_mm));
  pose.independent_points = read_independent_points(reader, pose);
  pose.known = read_known(reader, name, result.imaged_pose);
  if (pose.gravity.isZero(0) && name != result.imaged_pose && (!pose.surface || name == "supine"))
    reader.fail("gravity",
                "is zero; give the direction in which things fall, of length 1. Zero (buoyancy) is for a pose "
                "that is imaged or measured");
  return pose;
}

void check_pose_name(const TomlReader& poses, const std::string& name) {
  constexpr std::size_t longest = 60;
  if (name.size() > longest)
    poses.fail(name, fmt::format("a pose names files: at most {} characters, not {}", longest, name.size()));
  const bool plain = std::all_of(name.begin(), name.end(),
                                 [](unsigned char c) { return (c < 128 && std::isalnum(c)) || c == '_' || c == '-'; });
  if (!plain || name.empty()) poses.fail(name, "a pose names files: use letters, digits, _ and - only");
  if (std::find(reserved_names.begin(), reserved_names.end(), name) != reserved_names.end())
    poses.fail(name, "this name belongs to a file the tools write; give the pose another");
}

/// Whether files of a pose of this name would be those that belong to another pose of the case, or to none.
bool takes_names_of(const std::string& name, const std::string& other) {
  if (name == "comparison_" + other || name == "scan_" + other) return true;
  if (!name.starts_with(other + "_")) return false;
  const std::string_view end = std::string_view(name).substr(other.size() + 1);
  constexpr std::string_view further[] = {"landmarks", "displacement", "calculix", "febio", "sofa"};
  return std::find(std::begin(further), std::end(further), end) != std::end(further) ||
         std::find(segmentation::tissue_names.begin(), segmentation::tissue_names.end(), end) !=
             segmentation::tissue_names.end();
}

void check_file_names(const TomlReader& poses, const Case& result) {
  for (const Pose& pose : result.poses) {
    std::vector<std::string> others = {undeformed};
    for (const Pose& other : result.poses) others.push_back(other.name);
    for (const std::string& other : others)
      if (takes_names_of(pose.name, other))
        poses.fail(pose.name, fmt::format("files of this pose would have the names of files that belong to pose '{}'; "
                                          "give it another name",
                                          other));
  }
}

/// Two scans of an object under the same load are two measurements of it.
void check_directions_differ(const TomlReader& poses, const Case& result) {
  const std::vector<Pose>& all = result.poses;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector3d &a = all[i].gravity, &b = all[j].gravity;
      if (a.isZero(0) != b.isZero(0) || all[j].name == undeformed ||
          (result.is_object() && all[i].surface && all[j].surface))
        continue;
      if (std::atan2(a.cross(b).norm(), a.dot(b)) >= same_direction_rad) continue;
      poses.sub_table(all[i].name)
          ->fail("gravity",
                 fmt::format("is the same direction as in [pose.{}] (within {} rad); a second pose needs another load",
                             all[j].name, same_direction_rad));
    }
}

/// Whether two files hold the same bytes.
bool same_content(const fs::path& a, const fs::path& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  if (!fs::is_regular_file(a) || !fs::is_regular_file(b) || fs::file_size(a) != fs::file_size(b)) return false;
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  return std::equal(std::istreambuf_iterator<char>(first), {}, std::istreambuf_iterator<char>(second));
}

/// A body that lies otherwise has another shape: one file for two poses is in one of them by mistake.
void check_files_differ(const TomlReader& poses, const Case& result) {
  const auto check = [&](const char* key, std::optional<fs::path> Pose::*file) {
    for (const Pose& pose : result.poses)
      for (const Pose* before = result.poses.data(); before != &pose; ++before)
        if (pose.*file && before->*file && same_content(*(pose.*file), *(before->*file)))
          poses.sub_table(pose.name)->fail(
              key,
              fmt::format("holds the same as that of [pose.{}]; each pose has a measurement of its own", before->name));
  };
  check("surface", &Pose::surface);
  check("landmarks", &Pose::landmarks);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// The imaged one and supine first, as far as they must be there or are, the others as they stand in the file.
std::vector<std::string> pose_order(const TomlReader& poses, const Case& result) {
  std::vector<std::string> names;
  if (result.imaged_pose != undeformed) names.push_back(result.imaged_pose);
  if (result.imaged_pose != "supine" && (!result.is_object() || poses.has("supine"))) names.emplace_back("supine");
  std::vector<std::pair<toml::source_position, std::string>> others;
  for (const auto& [key, node] : poses.table())
    if (std::find(names.begin(), names.end(), key.str()) == names.end())
      others.emplace_back(key.source().begin, std::string(key.str()));
  std::sort(others.begin(), others.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first.line, a.first.column) < std::pair(b.first.line, b.first.column);
  });
  for (auto& [position, name] : others) names.push_back(std::move(name));
  return names;
}

std::vector<std::string> read_expected(const TomlReader& priors) {
  const auto names = priors.texts("expected").value_or(std::vector<std::string>{});
  for (const std::string& name : names) {
    if (simulation::find_effect(name) != nullptr) continue;
    std::vector<std::string> known;
    for (const auto* effect : simulation::catalogue()) known.push_back(effect->name());
    priors.fail("expected", fmt::format("\"{}\" is no effect of the catalogue ({})", name, fmt::join(known, ", ")));
  }
  return names;
}

void read_poses(const TomlReader& file, Case& result) {
  const auto poses = file.sub_table("pose");
  if (!poses && result.is_object()) file.fail("pose", "tables [pose.NAME] are missing: they say how things fall");
  if (!poses) file.fail("pose", "tables [pose.prone] and [pose.supine] are missing: they say how things fall");
  if (result.imaged_pose == undeformed) result.poses.push_back({undeformed, Eigen::Vector3d::Zero(), {}, {}, {}, {}});
  for (const std::string& name : pose_order(*poses, result)) {
    const auto pose = poses->sub_table(name);
    if (!pose && name == result.imaged_pose && name != "prone")
      poses->fail(name,
                  fmt::format("table [pose.{}] is missing: [image] pose names it as the pose that was imaged", name));
    if (!pose) poses->fail(name, fmt::format("table [pose.{}] is missing", name));
    check_pose_name(*poses, name);
    for (const Pose& before : result.poses)
      if (lower_case(before.name) == lower_case(name))
        poses->fail(name, fmt::format("differs from [pose.{}] in capitals only; give it another name", before.name));
    result.poses.push_back(read_pose(*pose, name, result));
  }
  check_file_names(*poses, result);
  check_directions_differ(*poses, result);
  if (!result.is_object()) check_files_differ(*poses, result);
}

void read_landmark_table(const TomlReader& file, Case& result) {
  if (const auto landmarks = file.sub_table("landmarks")) {
    landmarks->allow({result.imaged_pose});
    if (landmarks->has(result.imaged_pose)) result.prone_landmarks = case_path(*landmarks, result.imaged_pose, false);
  }
  const auto poses = file.sub_table("pose");
  for (const Pose& pose : result.poses)
    if (result.prone_landmarks && pose.landmarks && same_content(*pose.landmarks, *result.prone_landmarks))
      poses->sub_table(pose.name)->fail(
          "landmarks", fmt::format("holds the same as {} of [landmarks], the places in the image; each pose has a "
                                   "measurement of its own",
                                   result.imaged_pose));
  if (result.prone_landmarks) return;
  for (const Pose& pose : result.poses)
    if (pose.landmarks)
      poses->sub_table(pose.name)->fail(
          "landmarks", fmt::format("needs the {0} position of the same points: add [landmarks] with {0} = \"FILE.csv\"",
                                   result.imaged_pose));
}

std::vector<std::string> default_calibrated(const Case& result) {
  std::vector<std::string> measured;
  for (const Pose& pose : result.poses) {
    if (pose.name == result.imaged_pose) continue;
    if (pose.name == "supine" && (pose.surface || !result.is_object())) return {"supine"};
    if (pose.surface) measured.push_back(pose.name);
  }
  return measured;
}

/// @throws InputError  a name twice
void check_listed_once(const TomlReader& table, std::string_view key, const std::vector<std::string>& names) {
  for (auto name = names.begin(); name != names.end(); ++name)
    if (std::find(names.begin(), name, *name) != name) table.fail(key, fmt::format("\"{}\" is listed twice", *name));
}

void read_calibration(const TomlReader& file, Case& result) {
  result.calibrated_poses = default_calibrated(result);
  const auto calibration = file.sub_table("calibration");
  if (!calibration) return;
  calibration->allow({"poses"});
  const auto names = calibration->texts("poses");
  if (!names) return;
  if (names->empty()) calibration->fail("poses", "lists no pose; leave the key out to fit supine");
  for (const std::string& name : *names) {
    const auto pose =
        std::find_if(result.poses.begin(), result.poses.end(), [&](const Pose& p) { return p.name == name; });
    if (pose == result.poses.end()) calibration->fail("poses", fmt::format("there is no [pose.{}]", name));
    if (pose->name == result.imaged_pose)
      calibration->fail("poses", fmt::format("\"{}\" is the imaged pose: nothing of it is predicted", name));
    if (!pose->surface) calibration->fail("poses", fmt::format("[pose.{}] has no surface to fit", name));
  }
  check_listed_once(*calibration, "poses", *names);
  result.calibrated_poses = *names;
}

void read_register(const TomlReader& file, Case& result) {
  const auto table = file.sub_table("register");
  if (!table) return;
  table->allow({"on", "rigid"});
  if (const auto on = table->texts("on")) {
    if (on->empty()) table->fail("on", "names nothing to lay the scan on; leave the key out for landmarks and model");
    const std::vector<std::string> known = {"landmarks", "model", "support"};
    for (const std::string& name : *on)
      if (std::find(known.begin(), known.end(), name) == known.end())
        table->fail("on", fmt::format("\"{}\" is none of {}", name, listed(known)));
    check_listed_once(*table, "on", *on);
    result.register_on.on = *on;
  }
  result.register_on.rigid = table->texts("rigid").value_or(std::vector<std::string>());
  check_listed_once(*table, "rigid", result.register_on.rigid);
}

void read_head(const TomlReader& file, Case& result) {
  const auto head = file.sub_table("case");
  if (!head) file.fail("case", "table [case] is missing: it says name, frame and side");
  head->allow({"name", "frame", "side", "body"});
  result.name = head->required_text("name");
  result.frame = head->choice("frame", {"LPS", "RAS"}, "LPS");
  result.body = head->choice("body", {"breast", "object"}, "breast");
  if (result.is_object()) {
    if (head->has("side")) head->fail("side", "belongs to body = \"breast\"; an object has none, leave it out");
    result.side = "none";
    return;
  }
  head->required_text("side");
  result.side = head->choice("side", {"left", "right", "both"}, "");
}

}  // namespace

const Pose& Case::pose(std::string_view wanted) const {
  std::vector<std::string> names;
  for (const Pose& pose : poses) {
    if (pose.name == wanted) return pose;
    names.push_back(pose.name);
  }
  throw InputError(fmt::format("case {} has no pose {}; it has {}", name, wanted, listed(names)));
}

Case read_case(const fs::path& folder) {
  if (!fs::exists(folder)) throw InputError(fmt::format("case folder {} is not there", folder.string()));
  if (!fs::is_directory(folder))
    throw InputError(fmt::format("{} is not a folder; name the folder that holds case.toml", folder.string()));
  const fs::path path = folder / "case.toml";
  if (!fs::exists(path))
    throw InputError(
        fmt::format("{} is not there; a case is a folder with a case.toml (docs/case-file.md)", path.string()));
  const toml::table table = parse_toml(path);
  const TomlReader file(table, path, "");
  file.allow({"case", "image", "segmentation", "pose", "landmarks", "calibration", "register", "priors"});
  Case result;
  result.folder = folder;
  read_head(file, result);
  read_case_image(file, result);
  read_poses(file, result);
  read_landmark_table(file, result);
  read_calibration(file, result);
  read_register(file, result);
  if (const auto priors = file.sub_table("priors")) {
    priors->allow({"cohort", "expected"});
    if (!priors->has("expected")) priors->require("cohort");
    if (priors->has("cohort")) result.cohort = case_path(*priors, "cohort", false);
    result.expected = read_expected(*priors);
  }
  return result;
}

}  // namespace supine::pipeline
