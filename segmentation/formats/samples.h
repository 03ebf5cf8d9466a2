// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace supine::segmentation::formats {

/// How a file stores one number.
enum class SampleType { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 };

std::size_t size_of(SampleType type);

/// Converts raw samples to float.
/// @param big_endian  byte order of @p bytes
/// @pre bytes.size() is a multiple of size_of(type)
std::vector<float> to_floats(std::span<const std::byte> bytes, SampleType type, bool big_endian);

}  // namespace supine::segmentation::formats
