// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/pipeline/small_run.h"

#include <cstdlib>
#include <memory>
#include <stdexcept>

#include "tests/pipeline/small_case.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {

std::vector<std::string> stage_command(const std::string& stage, const std::filesystem::path& folder) {
  const std::string in_case = folder.string(), out = (folder / "out").string();
  const std::vector<std::string> tail = {"--threads", "2"};
  std::vector<std::string> command = {tool(stage)};
  const auto add = [&command](std::vector<std::string> words) {
    command.insert(command.end(), words.begin(), words.end());
  };
  if (stage == "segment") add({in_case, "-o", out + "/labels.vti", "--overlays", out + "/overlays"});
  if (stage == "reconstruct") add({out + "/labels.vti", "-o", out});
  if (stage == "decimate")
    add({out + "/breast.vtp", "--triangles", "800", "--max-distance-mm", "2", "-o", out + "/coarse.vtp"});
  if (stage == "tetrahedralise")
    add({out + "/coarse.vtp", out + "/muscle.vtp", out + "/labels.vti", "-o", out + "/mesh.vtu"});
  if (stage == "simulate") add({in_case, out + "/mesh.vtu", "--model", in_case + "/model.toml", "-o", out});
  if (stage == "compare") add({in_case, out + "/supine.vtu", "-o", out});
  add(tail);
  return command;
}

std::vector<std::string> make_command(const std::filesystem::path& folder) {
  // Not a child of the make that runs the tests: its flags would print the folder and count its jobs.
  return {"env",
          "-u",
          "MAKEFLAGS",
          "-u",
          "MAKELEVEL",
          "make",
          "-f",
          std::string(SUPINE_SOURCE_DIR) + "/pipeline/Makefile",
          "BIN=" SUPINE_BIN_DIR,
          "CASE=" + folder.string(),
          "OUT=" + (folder / "out").string(),
          "ORDER=1",
          "TRIANGLES=800",
          "MAX_DISTANCE_MM=2",
          "THREADS=2"};
}

void make_small_run(const std::filesystem::path& folder) {
  write_small_case(folder);
  const Finished finished = run_process(make_command(folder));
  if (finished.code != 0) throw std::runtime_error("the small case failed: " + finished.err);
}

const std::filesystem::path& small_run() {
  static const std::unique_ptr<TemporaryFolder> own = [] {
    if (std::getenv("SUPINE_SMALL_RUN")) return std::unique_ptr<TemporaryFolder>();
    auto folder = std::make_unique<TemporaryFolder>();
    make_small_run(folder->path());
    return folder;
  }();
  static const std::filesystem::path path = own ? own->path() : std::filesystem::path(std::getenv("SUPINE_SMALL_RUN"));
  return path;
}

}  // namespace supine::pipeline
