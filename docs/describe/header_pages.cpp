// Pages of what stands in headers only: tuned numbers, status bits, exit statuses.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <regex>

#include "base/error.h"
#include "docs/describe/header_members.h"
#include "docs/describe/markdown.h"
#include "docs/describe/pages.h"
#include "runtime/safety/fault.h"
#include "runtime/tick/status.h"

namespace palpate {
namespace {

/// A comment that begins with a unit in brackets, cut in two.
struct Meaning {
  std::string unit;
  std::string text;
};

Meaning split_unit(const std::string& comment) {
  const std::size_t end = comment.find(']');
  if (!comment.starts_with('[') || end == std::string::npos) return {"", comment};
  return {comment.substr(1, end - 1), comment.substr(std::min(end + 2, comment.size()))};
}

/// The rows of a table of names in the code, each with its comment in the header.
template <class Named>
std::vector<std::vector<std::string>> named_rows(const std::vector<Declaration>& header, const char* type,
                                                 const Named& names) {
  const std::vector<Member>& members = declaration(header, type).members;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [value, name] : names) {
    const auto member = std::ranges::find(members, std::string(name), &Member::name);
    const bool is_said = member != members.end() && !member->comment.empty();
    if (!is_said && std::string(name) != "none")
      throw Error("has no doc comment", std::string(type) + "::" + name, "add it to the header");
    rows.push_back(
        {std::to_string(static_cast<std::uint32_t>(value)), code(name), is_said ? member->comment : ""});
  }
  return rows;
}

/// Decimal value and bit of each status.
std::vector<std::vector<std::string>> status_rows() {
  std::vector<std::vector<std::string>> rows =
      named_rows(declarations_of("runtime/tick/status.h"), "StepStatus", status_names);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto bit = std::countr_zero(static_cast<std::uint32_t>(status_names[k].first));
    rows[k].insert(rows[k].begin(), std::to_string(bit));
  }
  return rows;
}

/// A number or several of them, without what only the compiler needs.
std::string value_of(const std::string& initializer) {
  return std::regex_replace(initializer, std::regex("[{}]|F$"), "");
}

/// A comment names the page of decisions as a file of the tree.
std::string linked(const std::string& comment) {
  return std::regex_replace(comment, std::regex("docs/decisions"), "[decisions](../decisions-contact.md)");
}

std::vector<std::vector<std::string>> tuning_rows(const Declaration& group) {
  std::vector<std::vector<std::string>> rows;
  for (const Member& member : group.members) {
    const auto [unit, meaning] = split_unit(member.comment);
    rows.push_back({code(member.name), value_of(member.value), unit, linked(meaning)});
  }
  return rows;
}

/// The first sentence, as a heading has it: without the header that it may name in parentheses.
std::string heading_of(const std::string& comment) {
  return std::regex_replace(comment.substr(0, comment.find(". ")), std::regex(R"( \([\w/]+\.h\)|\.$)"), "");
}

std::string rest_of(const std::string& comment) {
  const std::size_t end = comment.find(". ");
  return end == std::string::npos ? "" : linked(comment.substr(end + 2)) + "\n\n";
}

}  // namespace

Page status_bits_page() {
  const std::vector<Declaration> faults = declarations_of("runtime/safety/fault.h");
  std::string text =
      "# Status bits and faults\n\n"
      "A tick never fails. Where it could not do all that was asked, it sets bits of a status word. You find "
      "them in `/ticks/status` of a [recording](recording-fields.md), in the report of `play`, in the viewer "
      "and in the C interface. No bit is set when all is well.\n\n";
  text += markdown_table({"bit", "value", "name", "meaning"}, status_rows());
  text +=
      "## Faults\n\n"
      "A fault ends the force on the hand until you acknowledge it (Enter or `SIGUSR1`); see "
      "[safety](../safety.md). Recordings have it in `/ticks/fault`.\n\n";
  text += markdown_table({"value", "name", "meaning"}, named_rows(faults, "Fault", fault_names));
  text +=
      "## Phases\n\nThe phase says whether the hand feels the force. Recordings have it in "
      "`/ticks/phase`.\n\n";
  text += markdown_table({"value", "name", "meaning"}, named_rows(faults, "SafetyPhase", safety_phase_names));
  return {"status-bits", text};
}

Page tuning_page() {
  const std::vector<Declaration> header = declarations_of("runtime/solve/tick_tuning.h");
  std::string text =
      "# Tuned numbers of the tick\n\n"
      "These constants are chosen, not derived. They stand in `runtime/solve/tick_tuning.h` and are compiled "
      "in; no option changes them. The unit `edge` is the mean edge of the body's surface at rest; a share "
      "of "
      "something names it as the unit. Where a value was chosen by a measurement, its row says which; no "
      "measurement is on record for the others. \"Multiplications\" are the measure of work that makes "
      "budgets "
      "independent of the machine.\n\n";
  for (const Member& part : declaration(header, "TickTuning").members) {
    const Declaration& group = declaration(header, part.type);
    text += fmt::format("## `{}`: {}\n\n{}", part.name, heading_of(group.comment), rest_of(group.comment));
    text += markdown_table({"name", "value", "unit", "meaning"}, tuning_rows(group));
  }
  return {"tuning", text};
}

Page exit_statuses_page() {
  std::vector<std::vector<std::string>> rows;
  const std::vector<Declaration> header = declarations_of("base/error.h");
  for (const Member& status : declaration(header, "ExitCode").members)
    rows.push_back({status.value, code(status.name), status.comment});
  return {"exit-statuses",
          "# Exit statuses\n\n"
          "Both programs end with one of these. What an error looks like and what to do about it: "
          "[errors](../errors.md).\n\n" +
              markdown_table({"status", "name in the code", "meaning"}, rows)};
}

}  // namespace palpate
