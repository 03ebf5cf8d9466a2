// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/hash.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <vector>

#include "common/error.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

class Digest {
 public:
  Digest() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1)
      throw Error("libcrypto offers no SHA-256");
  }
  void add(const char* bytes, std::size_t count) { EVP_DigestUpdate(context_.get(), bytes, count); }
  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
    unsigned int count = 0;
    EVP_DigestFinal_ex(context_.get(), bytes.data(), &count);
    std::string text;
    for (unsigned int i = 0; i < count; ++i) {
      text += "0123456789abcdef"[bytes[i] >> 4];
      text += "0123456789abcdef"[bytes[i] & 15];
    }
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

std::string hash_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError("cannot read " + file.string() + "; check that it exists and that you may read it");
  Digest digest;
  std::vector<char> buffer(1 << 20);
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || stream.gcount() > 0)
    digest.add(buffer.data(), static_cast<std::size_t>(stream.gcount()));
  if (stream.bad()) throw InputError("reading " + file.string() + " failed half-way; check the disk");
  return digest.hex();
}

std::string hash_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  Digest digest;
  for (const fs::path& file : files) {
    const std::string line = hash_file(file) + "  " + file.filename().string() + "\n";
    digest.add(line.data(), line.size());
  }
  return digest.hex();
}

}  // namespace

std::string sha256(const fs::path& file_or_folder) {
  if (fs::exists(file_or_folder) && !fs::is_directory(file_or_folder) && !fs::is_regular_file(file_or_folder))
    throw InputError(file_or_folder.string() +
                     " is neither a file nor a folder but a device or a pipe; copy it to a file");
  return fs::is_directory(file_or_folder) ? hash_folder(file_or_folder) : hash_file(file_or_folder);
}

}  // namespace supine::pipeline
