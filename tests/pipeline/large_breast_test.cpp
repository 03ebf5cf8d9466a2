// SPDX-License-Identifier: AGPL-3.0-or-later
// A breast as large and soft as volunteers', computed by another program (docs/data.md; skipped where it is not there).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/pipeline/process.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Json json_of(const fs::path& file) { return Json::parse(read_text(file)); }

/// From its labels to the comparison with its scan, on the default mesh, with the moduli that it has. The least stiff
/// ones that carry it there are a seventh less.
TEST(LargeBreast, LiesWhereAnotherProgramHasItWithItsTrueModuli) {
  const fs::path data = fs::path(SUPINE_SHARED_DATA) / "hidden-real-open";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not there";
  const TemporaryFolder folder;
  const fs::path in_case = folder / "case", out = folder / "out";
  fs::copy(data / "big-null-1", in_case);
  const Json truth = json_of(data / "answers" / "big-null-1.json").at("parameters");
  std::string model = read_text(in_case / "model.toml");
  model = replaced(model, "{ value = 0.5,", fmt::format("{{ value = {:.6f},", truth.at("Eb").get<double>()));
  model = replaced(model, "{ value = 20,", fmt::format("{{ value = {:.6f},", truth.at("Es").get<double>()));
  write_text(in_case / "model.toml", model);

  const Finished made =
      run_process({"env", "-u", "MAKEFLAGS", "-u", "MAKELEVEL", "make", "-f", SUPINE_SOURCE_DIR "/pipeline/Makefile",
                   "BIN=" SUPINE_BIN_DIR, "CASE=" + in_case.string(), "OUT=" + out.string(), "THREADS=2", "compare"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json compared = json_of(out / "comparison.json");
  EXPECT_LT(compared.at("mae_mm"), 1.2);
  for (const Json& landmark : compared.at("landmarks")) EXPECT_LT(landmark.at("error_mm"), 4) << landmark;
}

}  // namespace
}  // namespace supine::pipeline
