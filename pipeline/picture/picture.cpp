// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/picture/picture.h"

#include <fmt/format.h>

#include "common/error.h"

namespace supine::pipeline {

namespace fs = std::filesystem;

void declare_png(CLI::App& app, fs::path& file, const std::string& what) {
  app.add_option("--png", file, "also draw " + what + " into this file (.png); needs no display");
}

void announce_png(Run& run, const fs::path& file, const fs::path& output) {
  if (file.empty()) return;
  if (file.extension() != ".png") throw InputError(fmt::format("--png {}: the file ends in .png", file.string()));
  const bool beside = fs::weakly_canonical(fs::path(file).replace_extension()) ==
                      fs::weakly_canonical(fs::path(output).replace_extension());
  for (const char* other : {".vti", ".vtp", ".vtu", ".csv", ".toml", ".html"})
    if (const fs::path owner = fs::path(file).replace_extension(other); !beside && fs::exists(owner))
      throw InputError(fmt::format("--png {}: its figures would go into {}, which are those of {}; choose another name",
                                   file.string(), fs::path(file).replace_extension(".json").filename().string(),
                                   owner.filename().string()));
  run.output(file);
  if (!beside) run.figures(file) = {{"drawn_from", output.filename().string()}};
}

}  // namespace supine::pipeline
