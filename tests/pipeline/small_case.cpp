// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/pipeline/small_case.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

constexpr double foot_mm = 42, height_mm = 30, rim_mm = 9, outer_mm = 54, skin_mm = 3;

/// Thickness of the tissue over the muscle at distance r from the middle.
double thickness_mm(double r) { return rim_mm + height_mm * std::max(0.0, 1 - r * r / (foot_mm * foot_mm)); }

unsigned char label_at(double x, double y, double z) {
  const double r = std::hypot(x, z), top = -thickness_mm(r);
  if (y < top) return 0;
  if (y >= 0) return 3;
  if (r > outer_mm) return 5;
  if (y < top + skin_mm) return 4;
  return std::hypot(x, y + 15, z) < 13 ? 2 : 1;
}

}  // namespace

SmallVolume::SmallVolume() {
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        voxels.push_back(label_at(origin_mm[0] + spacing_mm * i, origin_mm[1] + spacing_mm * j + 0.1,
                                  origin_mm[2] + spacing_mm * k));
}

void SmallVolume::write(const std::filesystem::path& file, double spacing) const {
  std::ofstream stream(file, std::ios::binary);
  stream << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: " << size[0] << " " << size[1]
         << " " << size[2] << "\nspace directions: (" << spacing << ",0,0) (0," << spacing << ",0) (0,0," << spacing
         << ")\nkinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: (" << origin_mm[0] << ","
         << origin_mm[1] << "," << origin_mm[2] << ")\n\n";
  stream.write(reinterpret_cast<const char*>(voxels.data()), static_cast<std::streamsize>(voxels.size()));
}

void write_scan(const std::filesystem::path& file,
                const std::function<std::array<double, 3>(std::array<double, 3>)>& move) {
  constexpr int half = 20;
  constexpr double step_mm = 2;
  constexpr int across = 2 * half + 1;
  std::ofstream stream(file);
  stream << "ply\nformat ascii 1.0\nelement vertex " << across * across
         << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 2 * (across - 1) * (across - 1)
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int k = -half; k <= half; ++k)
    for (int i = -half; i <= half; ++i) {
      const double x = step_mm * i, z = step_mm * k;
      const auto p = move({x, -rim_mm - 0.75 * (thickness_mm(std::hypot(x, z)) - rim_mm), z});
      stream << p[0] << " " << p[1] << " " << p[2] << "\n";
    }
  // x and z span the sheet, -y is outside: x then z turns counter-clockwise seen from there.
  for (int k = 0; k + 1 < across; ++k)
    for (int i = 0; i + 1 < across; ++i) {
      const int a = k * across + i, b = a + 1, c = a + across, d = c + 1;
      stream << "3 " << a << " " << b << " " << d << "\n3 " << a << " " << d << " " << c << "\n";
    }
}

std::string small_case_toml() {
  return R"([case]
name = "small"
frame = "LPS"
side = "left"
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
[pose.prone]
gravity = [0.0, -1.0, 0.0]
[pose.supine]
gravity = [0.0, 1.0, 0.0]
surface = "supine.ply"
)";
}

std::string small_model_toml() {
  return R"([breast]
law = "neo_hookean"
young_modulus_kpa = { value = 2.0, prior_sd = 1.0, lower = 0.1, upper = 20 }
poisson_ratio = 0.45
[skin]
law = "neo_hookean"
young_modulus_kpa = 20
thickness_mm = 1.5
)";
}

void write_small_case(const std::filesystem::path& folder) {
  write_text(folder / "case.toml", small_case_toml());
  write_text(folder / "model.toml", small_model_toml());
  const SmallVolume volume;
  volume.write(folder / "labels.nrrd", volume.spacing_mm);
  write_scan(folder / "supine.ply");
}

}  // namespace supine::pipeline
