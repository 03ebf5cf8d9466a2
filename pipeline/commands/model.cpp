// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <fstream>

#include "common/error.h"
#include "common/outputs.h"
#include "meshing/anatomy.h"
#include "meshing/imaged_mesh.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/starting_model.h"
#include "pipeline/tool/tool.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using simulation::Parameter;
using simulation::Setting;

std::string setting_text(const Setting& setting) {
  if (!setting.free) return fmt::format("{}", setting.value);
  const std::string spread = setting.prior_sd ? fmt::format(" +- {}", *setting.prior_sd) : "";
  return fmt::format("{}{}  free in [{}, {}]", setting.value, spread, setting.lower, setting.upper);
}

class ModelTool : public Tool {
 public:
  std::string name() const override { return "supine-model"; }

  std::string summary() const override {
    return "Makes a model file to begin with, adds effects and removes them; shows what the file says and which "
           "effects "
           "there are.\n"
           "start writes CASE/model.toml, add and remove change model.toml itself, comments kept, unless -o names "
           "another "
           "file.\n\n"
           "Examples:\n"
           "  supine-model start mycase mycase/out/mesh.vtu\n"
           "  supine-model list\n"
           "  supine-model show mycase/model.toml\n"
           "  supine-model add ligament mycase/model.toml\n"
           "  supine-model add ligament mycase/model.toml --with arc=lower --with width_mm=20\n"
           "  supine-model remove ligament mycase/model.toml\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("action", action_, "start, list, show, add or remove")
        ->required()
        ->check(CLI::IsMember({"start", "list", "show", "add", "remove"}));
    app.add_option("arguments", arguments_, "start: CASE mesh.vtu; show: model.toml; add, remove: EFFECT model.toml")
        ->expected(0, 2);
    app.add_option("--with", with_, "add: NAME=VALUE of a number or an option of the effect, in place of the usual one")
        ->type_name("NAME=VALUE");
  }

  Outcome run(Run& run) override {
    const std::size_t wanted = action_ == "list" ? 0 : action_ == "show" ? 1 : 2;
    if (arguments_.size() != wanted)
      throw InputError(fmt::format("{} takes {}", action_,
                                   wanted == 0          ? "no further argument"
                                   : wanted == 1        ? "a model file"
                                   : action_ == "start" ? "a case folder and its mesh"
                                                        : "an effect and a model file"));
    if (!with_.empty() && action_ != "add")
      throw InputError("--with belongs to add: it says what an effect begins with");
    if (action_ == "list")
      list(run);
    else if (action_ == "show")
      show(run);
    else if (action_ == "start")
      start(run);
    else
      edit(run);
    return Outcome::done;
  }

 private:
  static void list_row(const Run& run, const Parameter& row) {
    run.say(fmt::format("    {:<36}{:<9}null {:<6} range {:>8} to {:<8} {}", row.name, row.unit == "1" ? "" : row.unit,
                        row.null, row.lower, row.upper, row.meaning));
  }

  static void list(const Run& run) {
    run.say("Base model");
    for (const Parameter& row : simulation::base_parameters())
      run.say(fmt::format("    {:<36}{:<9}range {:>8} to {:<8} {}", row.name, row.unit == "1" ? "" : row.unit,
                          row.lower, row.upper, row.meaning));
    run.say(fmt::format("    {:<36}{:<9}range {:>8} to {:<8} {}", "skin.fade_mm", "mm", 0, longest_skin_fade_mm,
                        "length over which skin and cut fade out where the skin ends; fixed"));
    run.say(fmt::format("    {:<36}{:<9}range {:>8} to {:<8} {}", "skin.bending_share", "", 0, most_skin_bending,
                        "of the bending stiffness of a plate as thick as the skin; fixed"));
    run.say("Effects (at null an effect leaves the model unchanged)");
    for (const simulation::Effect* effect : simulation::catalogue()) {
      run.say(fmt::format("  {}: {}", effect->name(), effect->meaning()));
      for (const Parameter& row : effect->parameters()) list_row(run, row);
      for (const auto& option : effect->options()) {
        std::string values = option.values.empty() ? "a name" : "";
        for (const std::string& value : option.values) values += (values.empty() ? "" : ", ") + value;
        run.say(fmt::format("    {:<36}{} (default {}) {}", option.name, values, option.default_value, option.meaning));
      }
    }
  }

  void show(Run& run) const {
    const simulation::Model model = read_model(run.input(arguments_[0]));
    const auto say = [&run](const char* key, const Setting& setting) {
      run.say(fmt::format("  {:<36}{}", key, setting_text(setting)));
    };
    for (const Parameter& row : simulation::base_parameters())
      if (simulation::why_not_of(model, row.name).empty())
        say(row.name.c_str(), simulation::base_setting(model, row.name));
    run.say(fmt::format("  {:<36}{}", "skin.fade_mm", model.skin.fade_mm));
    run.say(fmt::format("  {:<36}{}", "skin.bending_share", model.skin.bending_share));
    if (model.contact.kind != simulation::ContactKind::off) {
      run.say(model.contact.kind == simulation::ContactKind::skin ? "contact of skin with skin"
              : model.contact.kind == simulation::ContactKind::chest
                  ? "contact of skin with the chest beside the breast"
                  : "contact of skin with skin and with the chest beside the breast");
      run.say(fmt::format("  {:<36}{}", "contact.stiffness_kpa_per_mm", model.contact.stiffness_kpa_per_mm));
      run.say(fmt::format("  {:<36}{}", "contact.band_mm", model.contact.band_mm));
    }
    for (const auto& effect : model.effects) {
      run.say("effect " + effect.name);
      for (const auto& [key, setting] : effect.parameters) say(key.c_str(), setting);
      for (const auto& [key, value] : effect.options) run.say(fmt::format("  {:<36}{}", key, value));
    }
  }

  void start(Run& run) {
    const Case described = read_case(arguments_[0]);
    if (described.is_object())
      throw InputError(
          fmt::format("{} is not a breast: state its moduli in model.toml (docs/model-file.md)", arguments_[0]));
    const meshing::TetMesh mesh = meshing::read_imaged_mesh(run.input(arguments_[1]), described.side);
    const double height_mm = meshing::compute_anatomy(mesh, described.side).mound_height_mm;
    const fs::path target = output.empty() ? fs::path(arguments_[0]) / "model.toml" : output;
    Outputs outputs(run.force());
    std::ofstream(outputs.stage(target), std::ios::binary) << starting_model(height_mm);
    outputs.commit();
    run.say(fmt::format("{} fits a breast {:.0f} mm high", target.string(), height_mm));
  }

  void edit(Run& run) {
    const std::string& effect = arguments_[0];
    const fs::path file = arguments_[1];
    const fs::path target = output.empty() ? file : output;
    const ModelText given = read_model_text(file);
    const std::string text =
        action_ == "add" ? with_effect(given, effect, chosen_values(with_)) : without_effect(given, effect);
    // Changing the named file is what was asked for, so only another target needs --force.
    Outputs outputs(output.empty() || run.force());
    const fs::path temporary = outputs.stage(target);
    std::ofstream(temporary, std::ios::binary) << text;
    read_model(temporary);
    outputs.commit();
    run.say(fmt::format("{} {} {}", target.string(), action_ == "add" ? "now has" : "no longer has", effect));
  }

  std::string action_;
  std::vector<std::string> arguments_, with_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::ModelTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
