#include "runtime/push/push_command.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "runtime/push/other_program.h"

namespace palpate {
namespace {

constexpr const char* precompute_group = "Handed on to palpate-precompute";

void add_handed_on(CLI::App& push, PushArguments& arguments, const std::string& name,
                   const std::string& value, const std::string& meaning) {
  const std::string option = "--" + name;
  if (value.empty()) {
    push.add_flag_callback(
            option, [&arguments, option] { arguments.for_precompute.push_back(option); }, meaning)
        ->group(precompute_group);
    return;
  }
  push.add_option_function<std::string>(
          option,
          [&arguments, option](const std::string& text) {
            arguments.for_precompute.insert(arguments.for_precompute.end(), {option, text});
          },
          meaning)
      ->type_name(value)
      ->group(precompute_group);
}

/// Returns the file named in palpate-precompute's report.
std::string output_of(const std::string& report) {
  const nlohmann::json json = nlohmann::json::parse(report, nullptr, false);
  if (!json.is_object() || !json.contains("models") || json["models"].empty() ||
      !json["models"][0].contains("output") || !json["models"][0]["output"].is_string())
    throw Error("palpate-precompute printed no report", "palpate-precompute",
                "use a palpate-precompute of this version");
  return json["models"][0]["output"];
}

}  // namespace

CLI::App* add_push(CLI::App& app, PushArguments& arguments) {
  CLI::App* push = app.add_subcommand("push", "do all that it takes to push a body in a browser");
  push->add_option(
          "FILE", arguments.file,
          "surface (.stl, .obj, .ply, .off), labelled image (.nrrd, .nii, .inr), picture (.png, .pbm), "
          "description (.toml) or precomputed model NAME.palpate.hdf")
      ->required()
      ->type_name("");
  add_handed_on(*push, arguments, "output", "FILE",
                "file to write; default: NAME.palpate.hdf in the current folder");
  add_handed_on(*push, arguments, "unit", "UNIT",
                "unit of a surface or an image: mm, cm, m, um, in, or metres per unit (of a picture: per "
                "pixel); default: "
                "guessed");
  add_handed_on(*push, arguments, "surface-nodes", "N",
                "about how many nodes its surface has; default: 4000; on the outline of a picture's body 60");
  add_handed_on(*push, arguments, "element", "tet4a|tet10",
                "elements of a surface or an image, in a description that is written; default: tet4a");
  add_handed_on(*push, arguments, "range", "LOW:HIGH",
                "values of an image that are body, for a grey image (CT, MR) in place of labels");
  add_handed_on(*push, arguments, "parts", "largest|all", "which of several parts are the body");
  add_handed_on(*push, arguments, "strict", "", "refuse a surface that needs a repair");
  add_handed_on(*push, arguments, "renew", "", "write NAME.model.toml anew");
  add_handed_on(*push, arguments, "keep", "", "write no file that is there already");
  push->add_option("--duration", arguments.duration, "stop after this time [s]")->type_name("S");
  push->footer(
      "Runs palpate-precompute where the model is not there or its sources have changed, then plays it as\n"
      "palpate-runtime play FILE --view does, which has more options. A body of a picture, which nothing\n"
      "holds, is solved while you touch it: it falls, and keeps deep dents.\n"
      "Examples:\n"
      "  palpate-runtime push organ.stl\n"
      "  palpate-runtime push drawing.png\n"
      "  palpate-runtime push organ.stl --unit cm --renew");
  return push;
}

bool is_baked(const PushArguments& arguments) {
  if (!arguments.file.ends_with(".hdf")) return false;
  if (arguments.for_precompute.empty()) return true;
  throw CLI::ValidationError(arguments.for_precompute.front(),
                             "it is for what is precomputed first, and " + arguments.file + " is already");
}

Baked bake_first(const PushArguments& arguments) {
  std::vector<std::string> words = {"--unless-done", "--report", "-"};
  words.insert(words.end(), arguments.for_precompute.begin(), arguments.for_precompute.end());
  words.insert(words.end(), {"--", arguments.file});
  const ProgramEnd end = run_other_program(find_program("palpate-precompute"), words);
  if (end.status != exit_ok) return {.status = end.status, .file = ""};
  return {.status = exit_ok, .file = output_of(end.output)};
}

}  // namespace palpate
