// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace supine::reconstruction {

/// What the comments of a surface file say about its coordinates.
struct Declaration {
  std::optional<std::string> frame;  ///< LPS or RAS
  std::optional<std::string> unit;   ///< always mm
};

/// Takes in one comment: `frame LPS`, `frame=RAS`, `unit mm` anywhere in it; other words are left alone.
/// @throws InputError  naming @p file: another frame or unit, or one that contradicts an earlier comment
void read_declaration(std::string_view comment, const std::filesystem::path& file, Declaration& declaration);

std::vector<std::string> parted_by_blanks(const std::string& line);

/// Words 1 to 3 of a line: the coordinates of a vertex. Readers of other libraries stop at the comma of a decimal one,
/// and say nothing.
/// @throws InputError  naming @p file and @p line: one of them is no finite number
Eigen::RowVector3d read_coordinates(const std::vector<std::string>& words, const std::filesystem::path& file,
                                    long long line);

/// Checks an STL file before the reader proper sees it, which does not notice such damage.
/// @throws InputError  naming the line: wrong magic, a vertex that is not three finite numbers, fewer bytes or lines
/// than
///   the header promises
Declaration inspect_stl(const std::filesystem::path& file);

}  // namespace supine::reconstruction
