#include "base/help_json.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

/// Placeholder of an option's value, as help shows it.
std::string shown_value(const CLI::Option& option) {
  if (!option.get_option_text().empty()) return option.get_option_text();
  return option.get_type_size() == 0 ? "" : option.get_type_name();
}

Json argument_json(const CLI::Option& option) {
  const std::vector<std::string> names =
      option.nonpositional() ? option_names(option) : std::vector{option.get_name(true, false)};
  return {{"names", names},
          {"value", shown_value(option)},
          {"otherwise", option.get_default_str()},
          {"meaning", option.get_description()},
          {"group", option.get_group() == "Options" ? "" : option.get_group()},
          {"required", option.get_required()},
          {"repeatable", option.get_expected_max() >= CLI::detail::expected_max_vector_size}};
}

}  // namespace

std::vector<const CLI::Option*> arguments_of(const CLI::App& app) {
  std::vector<const CLI::Option*> all = app.get_options();
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* each) { return each->get_name().empty(); })) {
    for (const CLI::Option* option : group->get_options())
      if (option != group->get_help_ptr()) all.push_back(option);  // each group has one of its own
  }
  return all;
}

std::vector<std::string> option_names(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

Json help_json(const CLI::App& app) {
  Json json = {{"name", app.get_name()},     {"meaning", app.get_description()},
               {"footer", app.get_footer()}, {"positionals", Json::array()},
               {"options", Json::array()},   {"commands", Json::array()}};
  for (const CLI::Option* argument : arguments_of(app))
    json[argument->nonpositional() ? "options" : "positionals"].push_back(argument_json(*argument));
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* each) { return !each->get_name().empty(); }))
    json["commands"].push_back(help_json(*command));
  return json;
}

}  // namespace palpate
