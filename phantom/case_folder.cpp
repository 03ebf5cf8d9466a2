// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/case_folder.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>

#include "common/error.h"

namespace supine::phantom {
namespace {

namespace fs = std::filesystem;

void write_text(const std::string& text, const fs::path& target, Outputs& outputs) {
  const fs::path temporary = outputs.stage(target);
  std::ofstream stream(temporary, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) throw InputError("writing " + target.string() + " failed; check the free space on the disk");
}

std::string number_list(const Eigen::Vector3d& v) { return fmt::format("{:.6f}, {:.6f}, {:.6f}", v.x(), v.y(), v.z()); }

std::string case_text(const std::string& name, const CaseContents& contents) {
  std::string text = fmt::format(R"([case]
name = "{}"
frame = "LPS"
side = "{}"

[image]
file = "labels.nrrd"
kind = "labels"
cut = ["excluded"]
[image.labels]
air = [0]
adipose = [1]
gland = [2]
muscle = [3]
skin = [4]
excluded = [5]
tumour = [6]

[landmarks]
prone = "prone_landmarks.csv"

[pose.prone]
gravity = [{}]
)",
                                 name, contents.side, number_list(contents.prone_gravity));
  for (const MeasuredPose& pose : contents.poses)
    text += fmt::format(R"(
[pose.{0}]
gravity = [{1}]
surface = "{0}.ply"
noise_mm = {2}
landmarks = "{0}_landmarks.csv"
)",
                        pose.name, number_list(pose.gravity), contents.noise_mm);
  return text;
}

constexpr const char* contact_text = R"([contact]
kind = "chest"
)";

/// @param real_size  skin that resists bending, and the chest beside the breast
std::string model_text(bool real_size) {
  return fmt::format(R"([breast]
law = "neo_hookean"
young_modulus_kpa = {{ value = 0.5, prior_sd = 0.4, lower = 0.05, upper = 5 }}
poisson_ratio = 0.45
density_kg_m3 = 1000
density_refers_to = "undeformed"
[skin]
law = "neo_hookean"
young_modulus_kpa = {{ value = 20, prior_sd = 20, lower = 0.5, upper = 300 }}
thickness_mm = 1.5
compression = "tension_field"
compression_share = 0.05
{}[interface]
kind = "sliding"
normal_kpa_per_mm = 3.0
tangential_kpa_per_mm = 0.01
[cut]
kind = "elastic"
stiffness_kpa_per_mm = 1.0
{})",
                     real_size ? fmt::format("bending_share = {:g}\n", real_size_bending_share) : "",
                     real_size ? contact_text : "");
}

// One gzip member without name or time.
std::string gzipped(const std::vector<std::uint8_t>& bytes) {
  z_stream stream{};
  constexpr int gzip_window = 15 + 16;
  if (deflateInit2(&stream, 6, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw InputError("zlib could not be started: not enough memory");
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// @param bytes  of the voxels, little endian
std::string nrrd_text(const segmentation::Grid& grid, const char* type, const std::vector<std::uint8_t>& bytes) {
  const Eigen::Vector3d& step = grid.spacing_mm;
  return fmt::format(
             "NRRD0004\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
             "space directions: ({},0,0) (0,{},0) (0,0,{})\nkinds: domain domain domain\nendian: little\n"
             "encoding: gzip\nspace origin: ({},{},{})\n\n",
             type, grid.size.x(), grid.size.y(), grid.size.z(), step.x(), step.y(), step.z(), grid.origin_mm.x(),
             grid.origin_mm.y(), grid.origin_mm.z()) +
         gzipped(bytes);
}

std::string ply_text(const reconstruction::Surface& surface) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment frame LPS, unit mm\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      surface.points.rows(), surface.triangles.rows());
  for (Eigen::Index i = 0; i < surface.points.rows(); ++i)
    text += fmt::format("{:.3f} {:.3f} {:.3f}\n", surface.points(i, 0), surface.points(i, 1), surface.points(i, 2));
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    text += fmt::format("3 {} {} {}\n", surface.triangles(t, 0), surface.triangles(t, 1), surface.triangles(t, 2));
  return text;
}

std::string series_case_text(const std::string& name, Series series) {
  return fmt::format(R"([case]
name = "{}"
frame = "LPS"
side = "both"

[image]
file = "mri.nrrd"
kind = "mri"
[image.labels]                     # of the answer, for supine-segment --truth
air = [0, 7]
adipose = [1]
gland = [2]
skin = [3]
muscle = [4]
excluded = [5]
vessel = [6]

[segmentation]
recipe = "{}"

[pose.prone]
gravity = [0.0, -1.0, 0.0]
[pose.supine]
gravity = [0.0, 1.0, 0.0]
)",
                     name, series == Series::t1 ? "t1_auto" : "fatsat_auto");
}

}  // namespace

void write_series_folder(const fs::path& folder, const fs::path& truth, const MadeSeries& made, Series series,
                         Outputs& outputs) {
  const std::string name = fs::absolute(folder).lexically_normal().filename().string();
  write_text(series_case_text(name, series), folder / "case.toml", outputs);
  write_text(model_text(false), folder / "model.toml", outputs);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * made.image.voxels.size());
  for (const float grey : made.image.voxels) {
    const auto whole = static_cast<std::uint16_t>(std::clamp(grey, 0.0f, 65535.0f));
    bytes.push_back(static_cast<std::uint8_t>(whole & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(whole >> 8));
  }
  write_text(nrrd_text(made.image.grid, "uint16", bytes), folder / "mri.nrrd", outputs);
  write_text(nrrd_text(made.truth.grid, "uint8", made.truth.voxels), truth, outputs);
}

void write_case_folder(const fs::path& folder, const CaseContents& contents, Outputs& outputs) {
  const std::string name = fs::absolute(folder).lexically_normal().filename().string();
  write_text(case_text(name, contents), folder / "case.toml", outputs);
  write_text(model_text(contents.real_size), folder / "model.toml", outputs);
  write_text(nrrd_text(contents.labels.grid, "uint8", contents.labels.voxels), folder / "labels.nrrd", outputs);
  write_landmarks(contents.prone_landmarks, outputs.stage(folder / "prone_landmarks.csv"));
  for (const MeasuredPose& pose : contents.poses) {
    write_text(ply_text(pose.scan.surface), folder / (pose.name + ".ply"), outputs);
    write_landmarks(pose.scan.landmarks, outputs.stage(folder / (pose.name + "_landmarks.csv")));
  }
}

}  // namespace supine::phantom
