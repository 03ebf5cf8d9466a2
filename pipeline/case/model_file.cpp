// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/model_file.h"

#include <fmt/core.h>

#include <fstream>
#include <set>
#include <sstream>

#include "common/error.h"
#include "common/suggestion.h"
#include "common/toml_reader.h"
#include "simulation/catalogue.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

using simulation::Model;
using simulation::Parameter;
using simulation::Setting;

std::string with_unit(double value, const Parameter& row) {
  return row.unit.empty() || row.unit == "1" ? fmt::format("{}", value) : fmt::format("{} {}", value, row.unit);
}

std::string range_of(const Parameter& row) {
  return fmt::format("{} to {}", with_unit(row.lower, row), with_unit(row.upper, row));
}

/// @param place, key  what to name in a complaint: the table that holds the number, and its key there
void check_range(const TomlReader& place, std::string_view key, double number, const Parameter& row) {
  if (row.name.ends_with("poisson_ratio") && number >= 0.5)
    place.fail(key, "must be < 0.5: at 0.5 tissue is incompressible and these elements lock; 0.45 to 0.49 is usual");
  if (number < row.lower || number > row.upper)
    place.fail(key, fmt::format("out of range: {} must be in {}{}", row.name, range_of(row),
                                row.meaning.empty() ? "" : " (" + row.meaning + ")"));
}

void read_free_setting(const TomlReader& entry, const Parameter& row, Setting& setting) {
  entry.allow({"value", "prior_sd", "lower", "upper"});
  const auto value = entry.number("value");
  if (!value) entry.fail("value", "is missing: a free parameter needs a value to start from");
  setting.free = true;
  setting.value = *value;
  setting.prior_sd = entry.number("prior_sd");
  setting.lower = entry.number("lower").value_or(row.lower);
  setting.upper = entry.number("upper").value_or(row.upper);
  for (const char* key : {"value", "lower", "upper"})
    if (const auto number = entry.number(key)) check_range(entry, key, *number, row);
  if (setting.prior_sd && *setting.prior_sd <= 0) entry.fail("prior_sd", "must be > 0");
  if (setting.lower >= setting.upper)
    entry.fail("lower", fmt::format("must be below upper = {}", with_unit(setting.upper, row)));
  if (setting.value < setting.lower || setting.value > setting.upper)
    entry.fail("value", fmt::format("must lie between lower = {} and upper = {}", with_unit(setting.lower, row),
                                    with_unit(setting.upper, row)));
}

/// Reads @p key of @p section, where it is written, into @p setting: a number is fixed, a table is free.
void read_setting(const TomlReader& section, const std::string& key, const Parameter& row, Setting& setting) {
  setting.lower = row.lower;
  setting.upper = row.upper;
  if (!section.has(key)) return;
  if (section.table().get(key)->is_table()) return read_free_setting(*section.sub_table(key), row, setting);
  if (!section.table().get(key)->is_number())
    section.fail(
        key, "must be a number (fixed) or a table { value = ..., prior_sd = ..., lower = ..., upper = ... } (free)");
  setting.value = *section.number(key);
  check_range(section, key, setting.value, row);
}

template <class Choice>
void read_choice(const std::optional<TomlReader>& section, std::string_view key,
                 const std::vector<std::pair<std::string, Choice>>& values, Choice& choice) {
  if (section) choice = section->choice<Choice>(key, values).value_or(choice);
}

std::vector<std::pair<std::string, simulation::InterfaceKind>> interface_kinds() {
  using simulation::InterfaceKind;
  return {{"sliding", InterfaceKind::sliding}, {"elastic", InterfaceKind::elastic}, {"fixed", InterfaceKind::fixed}};
}

/// [supports.NAME]: what is another on one support than [interface] says.
void read_supports(const TomlReader& file, Model& model) {
  const auto supports = file.sub_table("supports");
  if (!supports) return;
  for (const auto& [key, node] : supports->table()) {
    const std::string name(key.str());
    const auto table = supports->sub_table(name);
    if (!table) supports->fail(name, fmt::format("must be a table: write [supports.{}]", name));
    table->allow({"kind", "normal_kpa_per_mm", "tangential_kpa_per_mm"});
    simulation::SupportSetting& own = model.supports[name];
    own.kind = table->choice<simulation::InterfaceKind>("kind", interface_kinds());
    own.normal_kpa_per_mm = table->number("normal_kpa_per_mm", {.lower = 1e-6, .upper = 1e6});
    own.tangential_kpa_per_mm = table->number("tangential_kpa_per_mm", {.lower = 1e-9, .upper = 1e6});
  }
}

/// [contact]: fixed numbers of a device, none of which is ever fitted.
void read_contact(const TomlReader& file, Model& model) {
  using simulation::ContactKind;
  const auto section = file.sub_table("contact");
  if (!section) return;
  simulation::ContactSettings& contact = model.contact;
  if (section->has("stiffness_kpa_per_mm") && !section->has("kind"))
    section->fail("stiffness_kpa_per_mm",
                  "acts with kind = \"skin\", \"chest\" or \"all\"; kind = \"off\" keeps it for later");
  read_choice<ContactKind>(section, "kind",
                           {{"off", ContactKind::off},
                            {"skin", ContactKind::skin},
                            {"chest", ContactKind::chest},
                            {"all", ContactKind::all}},
                           contact.kind);
  contact.stiffness_kpa_per_mm =
      section->number("stiffness_kpa_per_mm", {.lower = 1e-3, .upper = 1e3}).value_or(contact.stiffness_kpa_per_mm);
  contact.band_mm = section->number("band_mm", {.lower = 0.01, .upper = 5}).value_or(contact.band_mm);
  section->allow_no_more();
}

void read_choices(const TomlReader& file, Model& model) {
  using namespace simulation;
  const auto breast = file.sub_table("breast"), skin = file.sub_table("skin");
  read_choice<BulkLaw>(breast, "law", bulk_law_names(), model.breast.law);
  read_choice<Volumetric>(breast, "volumetric", {{"mean", Volumetric::mean}, {"pointwise", Volumetric::pointwise}},
                          model.breast.volumetric);
  read_choice<DensityReference>(breast, "density_refers_to",
                                {{"imaged", DensityReference::imaged}, {"undeformed", DensityReference::undeformed}},
                                model.breast.density_refers_to);
  read_choice<SkinLaw>(skin, "law", {{"neo_hookean", SkinLaw::neo_hookean}, {"corotational", SkinLaw::corotational}},
                       model.skin.law);
  read_choice<Compression>(skin, "compression",
                           {{"tension_field", Compression::tension_field}, {"full", Compression::full}},
                           model.skin.compression);
  read_choice<InterfaceKind>(file.sub_table("interface"), "kind", interface_kinds(), model.interface.kind);
  read_choice<CutKind>(file.sub_table("cut"), "kind", {{"elastic", CutKind::elastic}, {"held", CutKind::held}},
                       model.cut.kind);
  if (skin) {
    model.skin.fade_mm = skin->number("fade_mm", {.lower = 0, .upper = longest_skin_fade_mm}).value_or(0);
    model.skin.bending_share = skin->number("bending_share", {.lower = 0, .upper = most_skin_bending}).value_or(0);
  }
}

/// "section" and "key" of a base row.
std::pair<std::string, std::string> split_name(const std::string& name) {
  const auto dot = name.find('.');
  return {name.substr(0, dot), name.substr(dot + 1)};
}

void check_base_keys(const TomlReader& file) {
  std::map<std::string, std::vector<std::string>> known = {{"breast", {"law", "density_refers_to", "volumetric"}},
                                                           {"skin", {"law", "compression", "fade_mm", "bending_share"}},
                                                           {"interface", {"kind"}},
                                                           {"cut", {"kind"}}};
  for (const Parameter& row : simulation::base_parameters()) {
    const auto [section, key] = split_name(row.name);
    known[section].push_back(key);
  }
  for (const auto& [section, keys] : known)
    if (const auto table = file.sub_table(section)) table->allow(keys);
}

void read_base(const TomlReader& file, Model& model) {
  check_base_keys(file);
  read_choices(file, model);
  for (const Parameter& row : simulation::base_parameters()) {
    const auto [section, key] = split_name(row.name);
    const auto table = file.sub_table(section);
    if (const std::string reason = simulation::why_not_of(model, row.name); !reason.empty()) {
      if (table && table->has(key)) table->fail(key, reason);
      continue;
    }
    Setting& setting = base_setting(model, row.name);
    if (table)
      read_setting(*table, key, row, setting);
    else
      setting.lower = row.lower, setting.upper = row.upper;
  }
}

const simulation::Effect& effect_of(const TomlReader& entry) {
  const std::string name = entry.required_text("name");
  if (const simulation::Effect* effect = simulation::find_effect(name)) return *effect;
  std::vector<std::string> names;
  for (const simulation::Effect* effect : simulation::catalogue()) names.push_back(effect->name());
  const std::string nearest = nearest_name(name, names);
  entry.fail("name", nearest.empty() ? "unknown effect; there are " + listed(names)
                                     : fmt::format("unknown effect; did you mean {}?", nearest));
}

simulation::EffectSetting read_effect(const TomlReader& entry) {
  const simulation::Effect& effect = effect_of(entry);
  std::vector<std::string> known = {"name"};
  for (const Parameter& row : effect.parameters()) known.push_back(row.name);
  for (const auto& option : effect.options()) known.push_back(option.name);
  entry.allow(known);
  simulation::EffectSetting result;
  result.name = effect.name();
  for (const Parameter& row : effect.parameters()) {
    Setting& setting = result.parameters[row.name];
    setting.value = row.median;
    read_setting(entry, row.name, row, setting);
  }
  for (const auto& option : effect.options())
    result.options[option.name] = option.values.empty()
                                      ? entry.text(option.name).value_or(option.default_value)
                                      : entry.choice(option.name, option.values, option.default_value);
  return result;
}

void read_effects(const TomlReader& file, Model& model) {
  if (!file.has("effect")) return;
  const toml::array* entries = file.table().get_as<toml::array>("effect");
  if (!entries || !entries->is_array_of_tables())
    file.fail("effect", "must be tables: write [[effect]], with two brackets, on a line of its own");
  std::set<std::string> seen;
  for (const toml::node& node : *entries) {
    const TomlReader entry(*node.as_table(), file.file(), "[effect]");
    model.effects.push_back(read_effect(entry));
    if (!seen.insert(model.effects.back().name).second) entry.fail("name", "this effect is in the file already");
  }
}

/// Refuses a free number that nothing depends on: a fit would give it an interval all the same.
void check_free_numbers_act(const TomlReader& file, const Model& model) {
  const auto check = [](const TomlReader& section, const std::string& key, const Setting& setting, const char* with) {
    if (setting.free)
      section.fail(
          key, fmt::format("is free, but nothing depends on it with {}: write it as a number, or change that", with));
  };
  if (model.interface.kind == simulation::InterfaceKind::fixed && model.supports.empty()) {
    const auto section = file.sub_table("interface");
    check(*section, "normal_kpa_per_mm", model.interface.normal_kpa_per_mm, "kind = \"fixed\"");
    check(*section, "tangential_kpa_per_mm", model.interface.tangential_kpa_per_mm, "kind = \"fixed\"");
  }
  if (model.cut.kind == simulation::CutKind::held)
    check(*file.sub_table("cut"), "stiffness_kpa_per_mm", model.cut.stiffness_kpa_per_mm, "kind = \"held\"");
  for (const simulation::EffectSetting& effect : model.effects) {
    const auto tie = effect.options.find("tie");
    const auto stiffness = effect.parameters.find("stiffness_kpa_per_mm");
    if (tie != effect.options.end() && tie->second == "rigid" && stiffness != effect.parameters.end())
      check(file, effect.name + ".stiffness_kpa_per_mm", stiffness->second, "tie = \"rigid\"");
  }
}

diagnosis::Patchiness patchiness_of(const TomlReader& file) {
  constexpr Bounds share{.lower = 0, .upper = 2}, length{.lower = 5, .upper = 200}, depth{.lower = 0, .upper = 10};
  diagnosis::Patchiness patchiness;
  const auto section = file.sub_table("patchiness");
  if (!section) return patchiness;
  const auto read = [&](const char* key, const Bounds& bounds, double& value) {
    value = section->number(key, bounds).value_or(value);
  };
  read("tissue", share, patchiness.tissue);
  read("tissue_length_mm", length, patchiness.tissue_length_mm);
  read("skin", share, patchiness.skin);
  read("skin_length_mm", length, patchiness.skin_length_mm);
  read("muscle_mm", depth, patchiness.muscle_mm);
  read("muscle_length_mm", length, patchiness.muscle_length_mm);
  section->allow_no_more();
  return patchiness;
}

}  // namespace

ModelText read_model_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) throw InputError(fmt::format("cannot read {}", file.string()));
  std::ostringstream text;
  text << stream.rdbuf();
  return {file, text.str()};
}

simulation::Model read_model(const ModelText& given) {
  const toml::table table = parse_toml(given.text, given.file);
  const TomlReader file(table, given.file, "");
  file.allow({"breast", "skin", "interface", "supports", "cut", "contact", "effect", "patchiness"});
  Model model;
  read_base(file, model);
  read_supports(file, model);
  read_contact(file, model);
  read_effects(file, model);
  check_free_numbers_act(file, model);
  patchiness_of(file);  // complains of what is wrong there
  return model;
}

simulation::Model read_model(const std::filesystem::path& file) { return read_model(read_model_text(file)); }

diagnosis::Patchiness read_patchiness(const ModelText& given) {
  const toml::table table = parse_toml(given.text, given.file);
  return patchiness_of(TomlReader(table, given.file, ""));
}

diagnosis::Patchiness read_patchiness(const std::filesystem::path& file) {
  return read_patchiness(read_model_text(file));
}

}  // namespace supine::pipeline
