// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace supine::fuzz {

/// A reader of files that come from elsewhere, or that another tool may have left damaged.
struct Target {
  std::string name;
  /// What the parts of an input are written as, inside an empty folder: one part a file. A part for which there is no
  /// name left is dropped, files for which there is no part are not written.
  std::vector<std::string> files;
  /// Reads what lies there. May throw InputError and nothing else.
  std::function<void(const std::filesystem::path& folder)> read;
};

/// Every reader, in the order of the tools.
const std::vector<Target>& targets();

/// @throws InputError  there is none of that name
const Target& target_of(const std::string& name);

/// What parts the files of one input.
inline constexpr std::string_view separator = "\n=====\n";

/// The parts of @p files, in one input.
std::string joined(const std::vector<std::string>& parts);

/// Reads one input: writes its parts into a folder of its own, reads them, removes the folder.
/// An InputError is an answer; whatever else is thrown goes on to the caller.
void read_input(const Target& target, std::string_view input);

}  // namespace supine::fuzz
