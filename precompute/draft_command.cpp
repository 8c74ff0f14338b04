#include "precompute/draft_command.h"

#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <iostream>
#include <optional>

#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "precompute/description/not_a_description.h"
#include "precompute/draft/questions.h"
#include "precompute/progress.h"

namespace palpate {
namespace {

constexpr const char* group = "A surface, an image or a picture";

void tell(const std::string& line) {
  say(stderr, "{}\n", line);
}

/// Reads "-100:200"; nullopt if it is no range.
std::optional<ValueRange> read_range(const std::string& text) {
  ValueRange range{};
  const char* const end = text.data() + text.size();
  const auto [colon, bad] = std::from_chars(text.data(), end, range.low);
  if (bad != std::errc() || colon == end || *colon != ':') return {};
  const auto [last, bad_too] = std::from_chars(colon + 1, end, range.high);
  if (bad_too != std::errc() || last != end || !(range.low <= range.high)) return {};
  return range;
}

DraftOptions options_of(const DraftArguments& arguments) {
  DraftOptions options;
  if (!arguments.unit.empty()) options.unit = read_unit(arguments.unit);
  options.shape = {.parts = arguments.parts == "all"       ? SurfaceParts::all
                            : arguments.parts == "largest" ? SurfaceParts::largest
                                                           : SurfaceParts::most,
                   .strict = arguments.strict,
                   .range = read_range(arguments.range),
                   .nodes = arguments.nodes};
  options.renew = arguments.renew;
  options.tet10 = arguments.element == "tet10";
  return options;
}

}  // namespace

bool DraftArguments::given() const {
  return !unit.empty() || !parts.empty() || !range.empty() || strict || renew || nodes;
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
  app.add_option("--element", arguments.element,
                 "elements of a description that is written, for a surface or an image; default: tet4a")
      ->option_text("tet4a|tet10")
      ->check(CLI::IsMember({"tet4a", "tet10"}))
      ->group(group);
  app.add_option("--range", arguments.range,
                 "values of an image that are body, for a grey image (CT, MR) in place of labels")
      ->option_text("LOW:HIGH")
      ->check([](const std::string& text) {
        return read_range(text) ? "" : "'" + text + "' is not LOW:HIGH with LOW <= HIGH";
      })
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
  const bool any = arguments.given() || !arguments.element.empty();
  if (any && !shape_kind(model)) check_is_description(model);  // reports the kind of file
  if (!arguments.range.empty() && shape_kind(model) != ShapeKind::image)
    throw CLI::ValidationError("--range", "it is for an image, and '" + model + "' is none by its name");
  if (!any || shape_kind(model) || (!arguments.given() && !std::filesystem::exists(model))) return;
  throw CLI::ValidationError(
      "--unit, --surface-nodes, --parts, --range, --element, --strict and --renew",
      "they are for a surface, an image or a picture, and '" + model + "' is none by its name");
}

std::string described(const std::string& model, const DraftArguments& arguments, bool keep,
                      const std::filesystem::path& output) {
  if (!shape_kind(model)) return model;
  DraftOptions options = options_of(arguments);
  options.keep = keep;
  options.elsewhere = output.parent_path();
  std::optional<Waiting> waiting(std::in_place, "reading " + model + " and repairing it where needed");
  return draft(model, options, arguments.given(),
               [&](const std::string& line) {
                 waiting.reset();
                 tell(line);
               })
      .string();
}

int run_new(const std::string& file, const DraftArguments& arguments) {
  const std::filesystem::path description = draft_by_questions(
      file, options_of(arguments),
      {.answers = std::cin, .questions = std::cerr, .is_terminal = ::isatty(STDIN_FILENO) != 0});
  tell("next: palpate-precompute " + shell_word(description.string()));
  return exit_ok;
}

}  // namespace palpate
