#include "precompute/draft_command.h"

#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "precompute/draft/questions.h"

namespace palpate {
namespace {

constexpr const char* group = "A surface, an image or a picture";

void tell(const std::string& line) {
  say(stderr, "{}\n", line);
}

DraftOptions options_of(const DraftArguments& arguments) {
  DraftOptions options;
  if (!arguments.unit.empty()) options.unit = read_unit(arguments.unit);
  options.shape = {.parts = arguments.parts == "all"       ? SurfaceParts::all
                            : arguments.parts == "largest" ? SurfaceParts::largest
                                                           : SurfaceParts::most,
                   .strict = arguments.strict,
                   .nodes = arguments.nodes};
  options.renew = arguments.renew;
  return options;
}

}  // namespace

bool DraftArguments::given() const {
  return !unit.empty() || !parts.empty() || strict || renew || nodes;
}

void add_draft_options(CLI::App& app, DraftArguments& arguments) {
  app.add_option(
         "--unit", arguments.unit,
         "unit of the file, or metres per unit (of a picture: per pixel); default: guessed by the size")
      ->option_text(unit_choices)
      ->check([](const std::string& text) {
        return read_unit(text) ? "" : "'" + text + "' is none of " + unit_choices;
      })
      ->group(group);
  app.add_option(
         "--surface-nodes", arguments.nodes,
         "nodes on the surface of the mesh, about; default: 4000; on the outline of a picture's body 60")
      ->option_text("N")
      ->check(CLI::Range(50, 200'000))
      ->group(group);
  app.add_option("--parts", arguments.parts,
                 "which of several parts of a surface are the body: the largest, or all, united into one; "
                 "default: the largest, where it is nine tenths of them")
      ->option_text("largest|all")
      ->check(CLI::IsMember({"largest", "all"}))
      ->group(group);
  app.add_flag("--strict", arguments.strict, "refuse a surface that needs a repair")->group(group);
  app.add_flag("--renew", arguments.renew, "write NAME.model.toml anew where it is there already")
      ->group(group);
}

CLI::App* add_new(CLI::App& app, std::string& file, DraftArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "new", "ask questions and write the description of a surface, an image or a picture");
  command->add_option("FILE", file, "surface, labelled image or picture; default: it is asked for")
      ->type_name("");
  command->add_flag("--renew", arguments.renew, "write NAME.model.toml anew where it is there already");
  command->footer(
      "An empty answer takes what stands in brackets. Answers may come from a pipe, one per line.\n"
      "Example:\n"
      "  palpate-precompute new organ.stl    writes organ.model.toml");
  return command;
}

void check_draft_options(const std::string& model, const DraftArguments& arguments) {
  if (!arguments.given() || shape_kind(model)) return;
  throw CLI::ValidationError(
      "--unit, --surface-nodes, --parts, --strict and --renew",
      "they are for a surface, an image or a picture, and '" + model + "' is none by its name");
}

std::string described(const std::string& model, const DraftArguments& arguments, bool keep) {
  if (!shape_kind(model)) return model;
  DraftOptions options = options_of(arguments);
  options.keep = keep;
  return draft(model, options, arguments.given(), tell).string();
}

int run_new(const std::string& file, const DraftArguments& arguments) {
  const std::filesystem::path description = draft_by_questions(
      file, options_of(arguments),
      {.answers = std::cin, .questions = std::cerr, .is_terminal = ::isatty(STDIN_FILENO) != 0});
  tell("next: palpate-precompute " + shell_word(description.string()));
  return exit_ok;
}

}  // namespace palpate
