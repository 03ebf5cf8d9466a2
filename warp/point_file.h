// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/arrays.h"

namespace supine::warp {

/// Points that belong together in their order: the control points of a curve, of a line; or each by itself.
struct PointGroup {
  std::string name;
  std::string kind;           ///< of 3D Slicer: Fiducial, Line, Curve, ClosedCurve, Angle; points for a table
  Eigen::Index first, count;  ///< rows of the points
  bool connected() const { return kind == "Line" || kind == "Curve" || kind == "ClosedCurve"; }
};

/// A file of points as read, to be written again with other places and everything else as it was.
///
/// Known are a table (.csv, as common/landmarks.h), 3D Slicer's .fcsv and .mrk.json (fiducials, lines, curves, closed
/// curves, angles). Slicer's files name their frame, LPS or RAS; it is kept.
class PointFile {
 public:
  /// @param table_frame  LPS or RAS, of a .csv
  /// @throws InputError  naming file and line or markup: another extension, damaged, no points, a coordinate that is
  ///   not a finite number, a frame that is neither LPS nor RAS, a unit other than mm, a plane or a region of interest
  PointFile(const std::filesystem::path& file, const std::string& table_frame);
  ~PointFile();
  PointFile(PointFile&&) noexcept;

  const Points& points() const;                   ///< #P by 3, mm, LPS
  const std::vector<std::string>& names() const;  ///< #P
  const std::vector<PointGroup>& groups() const;
  const std::string& frame() const;      ///< of the file
  const std::string& extension() const;  ///< .csv, .fcsv or .mrk.json

  /// @param points  #P by 3, mm, LPS
  /// @throws InputError  when the file cannot be written
  void write(const Points& points, const std::filesystem::path& file) const;

  struct Content;

 private:
  std::unique_ptr<Content> content_;
};

}  // namespace supine::warp
