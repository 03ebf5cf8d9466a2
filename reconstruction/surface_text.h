// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace supine::reconstruction {

/// What the comments of a surface file say about its coordinates.
struct Declaration {
  std::optional<std::string> frame;  ///< LPS or RAS
  std::optional<std::string> unit;   ///< always mm
};

/// Takes in one comment: `frame LPS`, `frame=RAS`, `unit mm` anywhere in it; other words are left alone.
/// @throws InputError  naming @p file: another frame or unit, or one that contradicts an earlier comment
void read_declaration(std::string_view comment, const std::filesystem::path& file, Declaration& declaration);

/// Checks the text part of a file before the reader proper sees it, which does not notice such damage.
/// @throws InputError  naming the line: wrong magic, no vertices, a vertex that is not three finite numbers, a face of
///   two corners or that names a vertex there is not (OBJ), fewer bytes or lines than the header promises (STL)
Declaration inspect_stl(const std::filesystem::path& file);
Declaration inspect_obj(const std::filesystem::path& file);

}  // namespace supine::reconstruction
