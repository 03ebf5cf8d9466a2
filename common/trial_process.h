// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>

namespace supine {

/// Does @p read in a process of its own, whose output nobody hears, to see whether it comes to its end: readers of
/// libraries may be brought down by a damaged file. An InputError is no harm: whoever reads again meets it.
/// @param file  for the message
/// @throws InputError  the reader crashed, ended the process, threw anything else, asked for more than 4 GB and a
///   hundred times the file's size, or did not end in 300 s
void check_survivable(const std::filesystem::path& file, const std::function<void()>& read);

}  // namespace supine
