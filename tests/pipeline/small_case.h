// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace supine::pipeline {

/// A label volume of a dome on a flat muscle: 0 air, 1 adipose, 2 gland, 3 muscle, 4 skin, 5 excluded. LPS mm, prone
/// gravity -y. Coarse on purpose: the whole chain takes seconds.
struct SmallVolume {
  std::array<int, 3> size = {45, 22, 45};
  double spacing_mm = 3;
  std::array<double, 3> origin_mm = {-66, -48, -66};
  std::vector<unsigned char> voxels;

  SmallVolume();
  /// NRRD, raw. @p spacing is what the header says, in mm.
  void write(const std::filesystem::path& file, double spacing) const;
};

/// The measured surface: the dome flattened by a quarter, an ASCII PLY of triangles; @p move is applied to each point.
void write_scan(
    const std::filesystem::path& file,
    const std::function<std::array<double, 3>(std::array<double, 3>)>& move = [](auto p) { return p; });

/// Text of its case.toml and model.toml.
std::string small_case_toml();
std::string small_model_toml();

/// Writes case.toml, model.toml, labels.nrrd and supine.ply into @p folder.
void write_small_case(const std::filesystem::path& folder);

}  // namespace supine::pipeline
