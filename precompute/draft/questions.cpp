#include "precompute/draft/questions.h"

#include <fmt/format.h>

#include <charconv>
#include <functional>
#include <istream>
#include <ostream>

#include "base/error.h"
#include "base/printable.h"
#include "base/words.h"

namespace palpate {
namespace {

/// Handles an answer and returns what is wrong with it, or an empty text.
using Take = std::function<std::string(const std::string& answer)>;

/// Text without blanks at both ends.
std::string trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
}

void ask(const Conversation& with, const std::string& question, const std::string& otherwise,
         const Take& take) {
  for (;;) {
    with.questions << question << (otherwise.empty() ? "" : " [" + otherwise + "]") << ": " << std::flush;
    std::string line;
    if (!std::getline(with.answers, line)) {
      with.questions << std::endl;
      throw Error("the answers ended before the question: " + question, "palpate-precompute new",
                  "answer every question; an empty line takes what stands in brackets");
    }
    const std::string answer = trimmed(line);
    const std::string problem = take(answer.empty() ? otherwise : answer);
    if (!with.is_terminal) with.questions << '\n';
    if (problem.empty()) return;
    if (!with.is_terminal) throw Error(problem, "palpate-precompute new", "correct this answer: " + question);
    with.questions << problem << '\n';
  }
}

/// Asks for a number in an open interval.
double ask_number(const Conversation& with, const std::string& question, double otherwise, double above,
                  double below) {
  double number = otherwise;
  ask(with, question, shown(otherwise), [&](const std::string& answer) -> std::string {
    double value = 0.0;
    const auto [end, status] = std::from_chars(answer.data(), answer.data() + answer.size(), value);
    if (status != std::errc() || end != answer.data() + answer.size() || !(value > above && value < below))
      return fmt::format("'{}' is not a number between {} and {}", printable(answer), above, below);
    number = value;
    return "";
  });
  return number;
}

void ask_file(const Conversation& with, std::filesystem::path& file) {
  ask(with, "Surface (.stl, .obj, .ply, .off), labelled image (.nrrd, .nii, .inr) or picture (.png, .pbm)",
      "", [&](const std::string& answer) -> std::string {
        if (answer.empty()) return "a file is needed";
        if (!shape_kind(answer))
          return "'" + printable(answer) + "' is no surface, image or picture by its name";
        if (!std::filesystem::is_regular_file(answer)) return "there is no file '" + printable(answer) + "'";
        file = answer;
        return "";
      });
}

void ask_unit(const Conversation& with, DraftOptions& options) {
  ask(with, "Unit of the file: a guess by its size, or " + std::string(unit_choices),
      options.unit ? options.unit->name : "guess", [&](const std::string& answer) -> std::string {
        if (answer == "guess" || (options.unit && answer == options.unit->name)) return "";
        const std::optional<LengthUnit> unit = read_unit(answer);
        if (!unit) return "'" + printable(answer) + "' is no unit: " + unit_choices;
        options.unit = *unit;
        return "";
      });
}

void ask_axis(const Conversation& with, DraftValues& values) {
  ask(with, "Axis along which the lowest part is held: x, y or z", std::string(1, values.down),
      [&](const std::string& answer) -> std::string {
        if (answer != "x" && answer != "y" && answer != "z") return "'" + printable(answer) + "' is no axis";
        values.down = answer.front();
        return "";
      });
}

}  // namespace

std::filesystem::path draft_by_questions(std::filesystem::path file, DraftOptions options,
                                         const Conversation& with) {
  if (file.empty()) ask_file(with, file);
  const ShapeKind kind = shape_kind(file).value_or(ShapeKind::surface);
  DraftValues& values = options.values.emplace(usual_values(kind));
  ask(with, "Name of the model", shape_name(file), [&](const std::string& answer) -> std::string {
    if (answer.empty() || answer.find('/') != std::string::npos) return "a name without / is needed";
    values.name = answer;
    return "";
  });
  ask_unit(with, options);
  constexpr double stiffest = 1e13;  // [Pa] diamond has 1e12
  values.youngs_modulus = ask_number(with, "Young's modulus in pascals (soft tissue 1e3 to 1e5)",
                                     values.youngs_modulus, 0.0, stiffest);
  values.poissons_ratio =
      ask_number(with, "Poisson's ratio (soft tissue 0.45 to 0.49)", values.poissons_ratio, -1.0, 0.5);
  if (kind != ShapeKind::picture) {
    ask_axis(with, values);
    values.percent =
        ask_number(with, "How much of the height is held, in per cent", values.percent, 0.0, 100.0);
  }
  const std::string where = kind == ShapeKind::picture ? "Nodes on the outline" : "Nodes on the surface";
  options.shape.nodes = static_cast<int>(ask_number(with, where + " (more are finer and slower)",
                                                    options.shape.nodes_of(kind), 50.0, 200'000.0));
  return draft(file, options, true, [&](const std::string& line) { with.questions << line << '\n'; });
}

}  // namespace palpate
