// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/encode.h"

#include <openssl/evp.h>

#include <bit>
#include <vector>

namespace supine::pipeline {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

/// Base64 of the values, row by row, each as a @p Number.
template <class Number, class Values>
std::string encoded(const Values& values) {
  std::vector<Number> numbers;
  numbers.reserve(static_cast<std::size_t>(values.size()));
  for (const auto& row : values.rowwise())
    for (const auto value : row) numbers.push_back(static_cast<Number>(value));
  return base64(std::as_bytes(std::span(numbers)));
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
  // EVP_EncodeBlock counts in int and ends with a zero: pieces of a multiple of three bytes join without padding.
  constexpr std::size_t piece = 3 << 20;
  std::string text;
  text.reserve(4 * (bytes.size() / 3 + 1) + 1);
  std::vector<unsigned char> buffer(4 * (piece / 3) + 1);
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto part = bytes.subspan(at, std::min(piece, bytes.size() - at));
    const int length = EVP_EncodeBlock(buffer.data(), reinterpret_cast<const unsigned char*>(part.data()),
                                       static_cast<int>(part.size()));
    text.append(reinterpret_cast<const char*>(buffer.data()), static_cast<std::size_t>(length));
  }
  return text;
}

std::string base64_floats(const Points& values) { return encoded<float>(values); }

std::string base64_values(const Eigen::VectorXd& values) { return encoded<float>(values); }

std::string base64_indices(const Triangles& values) { return encoded<std::uint32_t>(values); }

std::string base64_bytes(const Eigen::VectorXi& values) { return encoded<std::uint8_t>(values); }

std::string json_for_script(const nlohmann::ordered_json& json) {
  std::string text = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  // Only strings can hold these, so the escape of a JSON string is always right.
  replace_all(text, "<", "\\u003c");
  replace_all(text, ">", "\\u003e");
  replace_all(text, "&", "\\u0026");
  replace_all(text, "\xE2\x80\xA8", "\\u2028");
  replace_all(text, "\xE2\x80\xA9", "\\u2029");
  return text;
}

std::string escape_html(std::string_view text) {
  std::string escaped(text);
  replace_all(escaped, "&", "&amp;");
  replace_all(escaped, "<", "&lt;");
  replace_all(escaped, ">", "&gt;");
  replace_all(escaped, "\"", "&quot;");
  replace_all(escaped, "'", "&#39;");
  return escaped;
}

}  // namespace supine::pipeline
