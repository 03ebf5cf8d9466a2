// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/dicom_file.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

namespace supine::segmentation::formats {

bool is_dicom(const std::filesystem::path& file) {
  char bytes[132] = {};
  std::ifstream(file, std::ios::binary).read(bytes, sizeof bytes);
  return std::memcmp(bytes + 128, "DICM", 4) == 0;
}

// Little endian (7fe0,0010), then in explicit files VR and two bytes, then the length.
bool is_cut_short(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  const std::size_t tag = bytes.find(std::string("\xE0\x7F\x10\x00", 4));
  if (tag == std::string::npos || tag + 12 > bytes.size()) return true;
  const bool explicit_vr = bytes[tag + 4] == 'O';
  std::uint32_t length = 0;
  for (int b = 3; b >= 0; --b)
    length = length << 8 | static_cast<unsigned char>(bytes[tag + (explicit_vr ? 8 : 4) + static_cast<std::size_t>(b)]);
  return length != 0xFFFFFFFF && tag + (explicit_vr ? 12 : 8) + length > bytes.size();
}

}  // namespace supine::segmentation::formats
