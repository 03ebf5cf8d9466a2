// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/samples.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

namespace supine::segmentation::formats {
namespace {

template <class T>
std::vector<float> convert(std::span<const std::byte> bytes, bool swap) {
  std::vector<float> floats(bytes.size() / sizeof(T));
  for (std::size_t n = 0; n < floats.size(); ++n) {
    std::byte raw[sizeof(T)];
    std::memcpy(raw, bytes.data() + n * sizeof(T), sizeof(T));
    if (swap) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    floats[n] = static_cast<float>(value);
  }
  return floats;
}

}  // namespace

std::size_t size_of(SampleType type) {
  switch (type) {
    case SampleType::u8:
    case SampleType::i8:
      return 1;
    case SampleType::u16:
    case SampleType::i16:
      return 2;
    case SampleType::u32:
    case SampleType::i32:
    case SampleType::f32:
      return 4;
    default:
      return 8;
  }
}

std::vector<float> to_floats(std::span<const std::byte> bytes, SampleType type, bool big_endian) {
  const bool swap = big_endian != (std::endian::native == std::endian::big);
  switch (type) {
    case SampleType::u8:
      return convert<std::uint8_t>(bytes, false);
    case SampleType::i8:
      return convert<std::int8_t>(bytes, false);
    case SampleType::u16:
      return convert<std::uint16_t>(bytes, swap);
    case SampleType::i16:
      return convert<std::int16_t>(bytes, swap);
    case SampleType::u32:
      return convert<std::uint32_t>(bytes, swap);
    case SampleType::i32:
      return convert<std::int32_t>(bytes, swap);
    case SampleType::u64:
      return convert<std::uint64_t>(bytes, swap);
    case SampleType::i64:
      return convert<std::int64_t>(bytes, swap);
    case SampleType::f32:
      return convert<float>(bytes, swap);
    default:
      return convert<double>(bytes, swap);
  }
}

}  // namespace supine::segmentation::formats
