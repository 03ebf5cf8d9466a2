// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/ply_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "common/error.h"

namespace supine::reconstruction {
namespace {

/// One property of an element of a PLY file.
struct PlyProperty {
  std::string name, type;
  std::string count_type;  ///< of a list; empty: a single number
};

struct PlyElement {
  std::string name;
  long long count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Format { ascii, little_endian, big_endian };
  Format format = Format::ascii;
  std::vector<PlyElement> elements;
  Declaration declaration;
  long long lines = 0;  ///< of the header
};

constexpr long long least_corners = 3;

struct PlyType {
  std::size_t bytes;
  char kind;  // i signed, u unsigned, f floating
};

const PlyType* type_of(const std::string& name) {
  static const std::map<std::string, PlyType> types = {
      {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
      {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
      {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
      {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
  const auto found = types.find(name);
  return found == types.end() ? nullptr : &found->second;
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// The numbers of the body one after the other, wherever they stand.
class Numbers {
 public:
  virtual ~Numbers() = default;
  virtual void begin_entry() = 0;
  virtual double next(const PlyType& type) = 0;
  virtual void end_entry() = 0;
  virtual std::string place() const = 0;  ///< of the entry, for messages
};

class AsciiNumbers : public Numbers {
 public:
  AsciiNumbers(std::istream& in, const std::filesystem::path& file, long long line)
      : in_(in), file_(file), line_(line) {}

  void begin_entry() override {
    std::string text;
    ++line_;
    if (!std::getline(in_, text))
      throw InputError(fmt::format("{}: cut short: it ends before line {}, its counts need more; copy the file again",
                                   file_.string(), line_));
    words_ = words_of(text);
    at_ = 0;
  }

  double next(const PlyType&) override {
    if (at_ == words_.size())
      throw InputError(fmt::format("{}: {} is cut short: it has {} numbers, the header promises more", file_.string(),
                                   place(), words_.size()));
    const std::string& word = words_[at_++];
    double value = 0;
    const char* begin = word.data() + (word[0] == '+' ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      throw InputError(fmt::format("{}: {}: \"{}\" is not a number{}", file_.string(), place(), word,
                                   word.find(',') == std::string::npos ? "" : "; decimals are written with a point"));
    return value;
  }

  void end_entry() override {
    if (at_ != words_.size())
      throw InputError(
          fmt::format("{}: {} has {} numbers, the header promises {}", file_.string(), place(), words_.size(), at_));
  }

  std::string place() const override { return fmt::format("line {}", line_); }

 private:
  std::istream& in_;
  std::filesystem::path file_;
  long long line_;
  std::vector<std::string> words_;
  std::size_t at_ = 0;
};

class BinaryNumbers : public Numbers {
 public:
  BinaryNumbers(std::istream& in, const std::filesystem::path& file, bool big_endian)
      : in_(in), file_(file), big_endian_(big_endian) {}

  void begin_entry() override { ++entry_; }

  double next(const PlyType& type) override {
    std::uint8_t bytes[8] = {};
    if (!in_.read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(type.bytes)))
      throw InputError(fmt::format("{}: cut short at {}; copy the file again", file_.string(), place()));
    if (big_endian_) std::reverse(bytes, bytes + type.bytes);
    std::uint64_t pattern = 0;
    for (std::size_t b = type.bytes; b-- > 0;) pattern = pattern << 8 | bytes[b];
    if (type.kind == 'f') return type.bytes == 4 ? as<float>(pattern) : as<double>(pattern);
    const std::uint64_t sign = std::uint64_t{1} << (8 * type.bytes - 1);
    if (type.kind == 'i' && (pattern & sign) != 0) return static_cast<double>(pattern) - 2 * static_cast<double>(sign);
    return static_cast<double>(pattern);
  }

  void end_entry() override {}
  std::string place() const override { return fmt::format("entry {} of the body", entry_); }

 private:
  template <class Value>
  static double as(std::uint64_t pattern) {
    Value value;
    std::memcpy(&value, &pattern, sizeof value);  // the low bytes, on the little-endian machines this runs on
    return static_cast<double>(value);
  }

  std::istream& in_;
  std::filesystem::path file_;
  bool big_endian_;
  long long entry_ = 0;
};

bool is_corners(const PlyElement& element, const PlyProperty& property) {
  return element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// @return  what stands in the list, where it is that of the corners of a face
std::vector<int> read_list(Numbers& numbers, const PlyProperty& property, bool corners, long long vertices,
                           const std::filesystem::path& file) {
  const double count = numbers.next(*type_of(property.count_type));
  constexpr double most = std::numeric_limits<std::uint32_t>::max();
  const double least = corners ? least_corners : 0;
  if (!(count >= least && count <= most) || count != std::floor(count))
    throw InputError(fmt::format("{}: {}: {} {} (at least {})", file.string(), numbers.place(),
                                 corners ? "a face of this many corners:" : "a list this long:", count, least));
  std::vector<int> face;
  for (long long k = 0; k < static_cast<long long>(count); ++k) {
    const double index = numbers.next(*type_of(property.type));
    if (!corners) continue;
    if (!(index >= 0 && index < static_cast<double>(vertices)) || index != std::floor(index))
      throw InputError(fmt::format("{}: {}: a face names vertex {}, the file has {} (0 to {})", file.string(),
                                   numbers.place(), index, vertices, vertices - 1));
    face.push_back(static_cast<int>(index));
  }
  return face;
}

const PlyElement* element_of(const PlyHeader& header, const std::string& name) {
  const auto found = std::find_if(header.elements.begin(), header.elements.end(),
                                  [&name](const PlyElement& element) { return element.name == name; });
  return found == header.elements.end() ? nullptr : &*found;
}

bool has(const PlyElement& element, const std::string& property) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [&property](const PlyProperty& p) { return p.name == property; });
}

void check_elements(const PlyHeader& header, const std::filesystem::path& file) {
  const PlyElement* vertex = element_of(header, "vertex");
  if (vertex == nullptr || vertex->count <= 0) throw InputError(fmt::format("{}: has no vertices", file.string()));
  for (const char* axis : {"x", "y", "z"})
    if (!has(*vertex, axis))
      throw InputError(fmt::format("{}: its header gives the vertices no property {}", file.string(), axis));
  const PlyElement* face = element_of(header, "face");
  if (face == nullptr || face->count == 0) return;
  for (const PlyProperty& property : face->properties)
    if (is_corners(*face, property) && !property.count_type.empty()) return;
  throw InputError(fmt::format("{}: its header gives the faces no list vertex_indices", file.string()));
}

void read_format(const std::vector<std::string>& w, const std::filesystem::path& file, PlyHeader& header) {
  static const std::map<std::string, PlyHeader::Format> formats = {
      {"ascii", PlyHeader::Format::ascii},
      {"binary_little_endian", PlyHeader::Format::little_endian},
      {"binary_big_endian", PlyHeader::Format::big_endian}};
  const auto found = formats.find(w.size() > 1 ? w[1] : "");
  if (found == formats.end())
    throw InputError(
        fmt::format("{}: its format is none of ascii, binary_little_endian and binary_big_endian", file.string()));
  header.format = found->second;
}

void read_element(const std::vector<std::string>& w, const std::filesystem::path& file, PlyHeader& header) {
  long long count = -1;
  if (w.size() == 3) {
    const auto [end, error] = std::from_chars(w[2].data(), w[2].data() + w[2].size(), count);
    if (error != std::errc() || end != w[2].data() + w[2].size()) count = -1;
  }
  if (count < 0)
    throw InputError(fmt::format("{}: line {} of the header: the count of an element is not a whole number",
                                 file.string(), header.lines));
  if (element_of(header, w[1]) != nullptr)
    throw InputError(
        fmt::format("{}: line {} of the header: element {} stands twice", file.string(), header.lines, w[1]));
  header.elements.push_back({w[1], count, {}});
}

void read_property(const std::vector<std::string>& w, const std::filesystem::path& file, PlyHeader& header) {
  const bool list = w.size() == 5 && w[1] == "list";
  const bool known = !header.elements.empty() && (list ? type_of(w[2]) != nullptr && type_of(w[3]) != nullptr
                                                       : w.size() == 3 && type_of(w[1]) != nullptr);
  if (!known)
    throw InputError(
        fmt::format("{}: line {} of the header is no property of a known type (char, uchar, short, "
                    "ushort, int, uint, float, double, or a list of them)",
                    file.string(), header.lines));
  header.elements.back().properties.push_back(list ? PlyProperty{w[4], w[3], w[2]} : PlyProperty{w[2], w[1], ""});
}

/// Counts that the file cannot hold are noticed before memory is asked for.
void check_size(std::istream& in, const std::filesystem::path& file, const PlyHeader& header) {
  const auto left = static_cast<long long>(std::filesystem::file_size(file)) - static_cast<long long>(in.tellg());
  for (const PlyElement& element : header.elements)
    if (element.count > left)
      throw InputError(
          fmt::format("{}: cut short: {} bytes follow the header, which counts {} of {}; copy the file "
                      "again",
                      file.string(), left, element.count, element.name));
}

void read_property_value(Numbers& numbers, const PlyElement& element, const PlyProperty& property, long long entry,
                         const std::filesystem::path& file, Polygons& surface) {
  if (!property.count_type.empty()) {
    const bool corners = is_corners(element, property);
    std::vector<int> list = read_list(numbers, property, corners, surface.points.rows(), file);
    if (corners) surface.faces.push_back(std::move(list));
    return;
  }
  const PlyType& type = *type_of(property.type);
  const double value = numbers.next(type);
  const auto axis = std::string("xyz").find(property.name);
  if (element.name == "vertex" && property.name.size() == 1 && axis != std::string::npos)
    surface.points(entry, static_cast<Eigen::Index>(axis)) =
        type.kind == 'f' && type.bytes == 4 ? static_cast<double>(static_cast<float>(value)) : value;
}

/// Leaves @p in behind it (Turk 1994).
PlyHeader read_header(std::istream& in, const std::filesystem::path& file) {
  PlyHeader header;
  std::string line;
  std::getline(in, line);
  if (line.substr(0, 3) != "ply")
    throw InputError(fmt::format("{}: not a PLY file (it does not begin with ply)", file.string()));
  bool format = false;
  for (header.lines = 2; std::getline(in, line); ++header.lines) {
    const std::vector<std::string> w = words_of(line);
    if (w.empty()) continue;
    if (w[0] == "end_header") {
      if (!format) read_format({}, file, header);
      check_elements(header, file);
      return header;
    }
    if (w[0] == "comment" || w[0] == "obj_info") {
      read_declaration(line, file, header.declaration);
    } else if (w[0] == "format") {
      read_format(w, file, header), format = true;
    } else if (w[0] == "element") {
      read_element(w, file, header);
    } else if (w[0] == "property") {
      read_property(w, file, header);
    } else {
      throw InputError(fmt::format("{}: line {} of the header begins with \"{}\", which no PLY header has",
                                   file.string(), header.lines, w[0]));
    }
  }
  throw InputError(fmt::format("{}: cut short: the PLY header has no end_header line", file.string()));
}

}  // namespace

Polygons read_ply(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()));
  const PlyHeader header = read_header(in, file);
  AsciiNumbers ascii(in, file, header.lines);
  BinaryNumbers binary(in, file, header.format == PlyHeader::Format::big_endian);
  Numbers& numbers = header.format == PlyHeader::Format::ascii ? static_cast<Numbers&>(ascii) : binary;
  const long long vertices = element_of(header, "vertex")->count;
  check_size(in, file, header);
  Polygons surface{Points(vertices, 3), {}, header.declaration};
  for (const PlyElement& element : header.elements)
    for (long long entry = 0; entry < element.count; ++entry) {
      numbers.begin_entry();
      for (const PlyProperty& property : element.properties)
        read_property_value(numbers, element, property, entry, file, surface);
      numbers.end_entry();
    }
  for (char rest = 0; in.get(rest);)
    if (rest != '\n' && rest != '\r' && rest != ' ' && rest != '\t' && rest != '\0')
      throw InputError(
          fmt::format("{}: goes on after the last entry that its header counts (\"element vertex {}\" and others): "
                      "counts are wrong, or two files were joined; write the file again",
                      file.string(), vertices));
  return surface;
}

}  // namespace supine::reconstruction
