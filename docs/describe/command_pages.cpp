// Pages of what is written on the command line.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "docs/describe/markdown.h"
#include "docs/describe/pages.h"
#include "runtime/app/play_command.h"
#include "runtime/safety/safety_options.h"

namespace palpate {
namespace {

/// An option that is no setting; its default is part of its meaning.
std::vector<std::string> option_row(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return {code(option.get_name(false, true) + (type.empty() ? "" : " " + type)), "", "",
          with_options_as_code(option.get_description())};
}

std::vector<std::string> setting_row(const Setting& setting) {
  return {code(fmt::format("--{} {}", setting.name, setting.value)), setting.unit,
          with_options_as_code(setting.otherwise), with_options_as_code(setting.meaning)};
}

std::string group_table(const CLI::App& play, const std::string& group) {
  std::vector<std::vector<std::string>> rows;
  for (const CLI::Option* option : play.get_options()) {
    if (option->get_group() != group || option->get_positional() || option->get_name() == "--help") continue;
    const Setting* setting = find_setting(option->get_single_name());
    rows.push_back(setting != nullptr ? setting_row(*setting) : option_row(*option));
  }
  return markdown_table({"option", "unit", "default", "meaning"}, rows);
}

}  // namespace

Page play_options_page() {
  CLI::App app("palpate-runtime");
  PlayArguments arguments;
  const CLI::App* play = add_play(app, arguments);
  std::string text =
      "# Options of `play`\n\n"
      "`palpate-runtime play NAME.palpate.hdf OPTIONS` runs the haptic loop. Give `--device`, `--view` or "
      "both; every other option has a default. `palpate-runtime play --help` prints the same list.\n\n"
      "Guides: [viewer](../viewer.md), [devices](../devices.md), [safety](../safety.md), "
      "[overlays](../overlays.md), [dynamics](../dynamics.md), [recordings](../recordings.md).\n\n";
  std::vector<std::string> groups;
  for (const CLI::Option* option : play->get_options()) {
    const std::string& group = option->get_group();
    if (group.empty() || option->get_positional() || std::ranges::find(groups, group) != groups.end())
      continue;
    groups.push_back(group);
  }
  for (const std::string& group : groups) text += "## " + group + "\n\n" + group_table(*play, group);
  text += "The bounds that `--safety` takes: [safety bounds](safety-bounds.md).\n";
  return {"play-options", text};
}

Page safety_bounds_page() {
  std::vector<std::vector<std::string>> rows;
  for_each_safety_field(SafetyOptions{}, [&](const SafetyField& field, const auto& number) {
    rows.push_back({code(std::string(field.name)), fmt::format("{}", number), std::string(field.unit),
                    std::string(field.range.words), std::string(field.meaning)});
  });
  return {"safety-bounds",
          "# Safety bounds\n\n"
          "Bounds between the computed force and a hand, for `play --safety NAME=NUMBER,...`. They are on by "
          "default where a hand is in the device; a bound that you don't name keeps its default, and the "
          "device's own limits hold where they are lower. What each rule does: [safety](../safety.md).\n\n" +
              markdown_table({"bound", "default", "unit", "allowed", "meaning"}, rows)};
}

}  // namespace palpate
