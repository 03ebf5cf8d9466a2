// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/tool/tool.h"
#include "reconstruction/surface.h"

namespace supine::pipeline {

/// Pictures of what the tools write, drawn with VTK on a virtual screen: no display is needed. The same input gives the
/// same picture. Orientation letters are the patient's: R L right and left, A P front and back, H F head and feet.
/// Colours can be told apart by the colour-blind (ColorBrewer RdBu; Okabe and Ito).

/// Adds --png to a tool's options. @param what  "the model's skin coloured by its distance to the scan"
void declare_png(CLI::App& app, std::filesystem::path& file, const std::string& what);

/// Refuses, before any work, a --png that does not end in .png, cannot be written, or whose sidecar would be that of
/// another file than @p output, which the picture is drawn from. No-op when @p file is empty.
/// @throws InputError
void announce_png(Run& run, const std::filesystem::path& file, const std::filesystem::path& output);

/// A skin (.vtp with triangles) coloured by its point array `distance_mm`, symmetric about 0, from the front and from
/// the outer side of every breast; grey where `covered` is 0. The largest errors are marked in mm.
/// @param file   of calibration::write_comparison() or diagnosis::write_error_map()
/// @param title  above the picture
/// @param side   left, right or both; none: an object, seen along the two short sides of its box
/// @param scan   of calibration::write_scan(); where nothing of the skin is covered, as by a contour, its points are
///   drawn in the skin's place, coloured alike, and the skin is see-through. Empty: none
/// @throws InputError  no display, no such array, not writable
void draw_distances(const std::filesystem::path& file, const std::string& title, const std::string& side,
                    const std::filesystem::path& png, const std::filesystem::path& scan = {});

/// The boundary of a tetrahedral mesh (.vtu) with its edges, coloured by `region`: from the front and from behind.
/// @throws InputError  as above
void draw_mesh(const std::filesystem::path& file, const std::string& title, const std::filesystem::path& png);

/// A body with a scan on it, as given and as found.
struct Placed {
  reconstruction::Surface body;           ///< only its triangles are drawn
  reconstruction::Surface before, after;  ///< the scan; triangles or bare points
  bool object = false;                    ///< no patient: seen along the short sides of its box
};
/// Body grey, scan orange where given, blue where found; from the front and from the left.
/// @throws InputError  as above
void draw_placement(const Placed& placed, const std::string& title, const std::filesystem::path& png);

struct Histogram {
  std::string title, axis;                            ///< axis with its unit
  std::vector<double> values;                         ///< at least 2
  std::vector<std::pair<std::string, double>> marks;  ///< vertical lines with a name, in the axis' unit
};
/// @throws InputError  as above
void draw_histogram(const Histogram& histogram, const std::filesystem::path& png);

}  // namespace supine::pipeline
