// SPDX-License-Identifier: AGPL-3.0-or-later
// The built tool on a small case whose folder, name and neighbouring files tell another story than its scan.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/pipeline/process.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class Blind : public testing::Test {
 protected:
  /// A copy of the small case; @p with_answers puts beside it what a generator of cases leaves there.
  fs::path copy(const std::string& name, bool with_answers) const {
    const fs::path folder = folder_ / name;
    run_process({"cp", "-a", small_run().string(), folder.string()});
    if (!with_answers) return folder;
    const std::string answer = R"({"case": ")" + name + R"(", "effect": "ligament", "seed": 7})";
    for (const char* file : {"answer.json", "truth.json", "answers/answer.json", "out/answer.json", "seed.json"})
      write_text(folder / file, answer);
    write_text(folder_ / "answers" / (name + ".json"), answer);
    write_text(folder / "answer.sealed", answer);
    return folder;
  }

  Json diagnosis(const fs::path& folder) const {
    const Finished finished =
        run_process({tool("diagnose"), folder.string(), (folder / "out/mesh.vtu").string(), "--model",
                     (folder / "model.toml").string(), "-o", (folder / "found").string(), "--refit", "2"});
    EXPECT_EQ(finished.code, 0) << finished.err;
    Json json = Json::parse(std::ifstream(folder / "found/diagnosis.json"));
    json.erase("timing");
    return json;
  }

  void TearDown() override { fs::remove_all(folder_ / "answers"); }

  TemporaryFolder folder_;
};

TEST_F(Blind, AnswersAndTheNameOfTheFolderChangeNoByte) {
  const fs::path named = copy("ligament-7", true);
  const Json first = diagnosis(named);
  const std::string shapes = read_text(named / "found/diagnosis.vtp");
  fs::remove_all(folder_ / "answers");
  fs::remove_all(named);
  const fs::path bare = copy("x", false);
  EXPECT_EQ(diagnosis(bare).dump(), first.dump());
  EXPECT_EQ(read_text(bare / "found/diagnosis.vtp"), shapes);
}

TEST_F(Blind, TheNameOfTheCaseEntersAsPartOfTheHashOfItsFileOnly) {
  const fs::path folder = copy("x", false);
  Json first = diagnosis(folder);
  const std::string text = read_text(folder / "case.toml");
  write_text(folder / "case.toml", replaced(text, "name = \"small\"", "name = \"adhesion-3\""));
  fs::remove_all(folder / "found");
  Json renamed = diagnosis(folder);
  EXPECT_NE(first["provenance"]["inputs"], renamed["provenance"]["inputs"]);
  first.erase("provenance");
  renamed.erase("provenance");
  EXPECT_EQ(first.dump(), renamed.dump());
}

}  // namespace
}  // namespace supine::pipeline
