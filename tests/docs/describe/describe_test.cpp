// The pages that palpate-describe writes: each member of each table of the code is in them, and
// docs/reference/ holds them as they are.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "base/error.h"
#include "docs/describe/header_members.h"
#include "docs/describe/markdown.h"
#include "docs/describe/pages.h"
#include "meshes/material_fields.h"
#include "precompute/description/description_keys.h"
#include "runtime/loop/settings.h"
#include "runtime/safety/fault.h"
#include "runtime/solve/tick_tuning.h"
#include "runtime/tick/status.h"
#include "tests/support/folders.h"

namespace palpate {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Rows of tables whose first cells are these words, with or without code marks.
std::ptrdiff_t rows_of(const std::string& page, const std::string& first_cell) {
  std::ptrdiff_t count = 0;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);)
    count += line.starts_with("| " + first_cell + " |") ? 1 : 0;
  return count;
}

TEST(Reference, PagesInTheSourceTreeAreWhatTheCodeSays) {
  for (const Page& page : reference_pages()) {
    const std::string file = "docs/reference/" + page.name + ".md";
    EXPECT_TRUE(text_of(palpate::test::source_file(file)) == page.text)
        << file
        << " is not of these sources: run build/release/docs/describe/palpate-describe docs/reference";
  }
}

TEST(Reference, HasARowForEachKeyOfEachTableOfAModel) {
  const std::string page = model_keys_page().text;
  std::ptrdiff_t keys = 0;
  for (const KeyTable& table : key_tables()) {
    if (table.title.starts_with(std::string(selection_title) + " "))
      continue;  // shown within the selection's row
    for (const ModelKey& key : table.keys) {
      EXPECT_GE(rows_of(page, code(std::string(key.key))), 1) << table.title << " " << key.key;
      EXPECT_FALSE(key.meaning.empty()) << table.title << " " << key.key;
      ++keys;
    }
  }
  for_each_material_field(Material{}, [&](const MaterialField& field, auto) {
    EXPECT_EQ(rows_of(page, code(std::string(field.key))), 1) << field.key;
    ++keys;
  });
  const std::regex row("\n\\| `[a-z_]+` \\|");
  const auto kinds = std::ssize(alternatives_of("[geometry]"));
  EXPECT_EQ(std::distance(std::sregex_iterator(page.begin(), page.end(), row), {}), keys + kinds);
}

TEST(Reference, SaysWhatEachKeyOfTheMeshIsFor) {
  const std::string page = model_keys_page().text;
  EXPECT_NE(page.find("| `element` | all |"), std::string::npos);
  EXPECT_NE(page.find("| `remesh` | `surface` by tetgen |"), std::string::npos);
  EXPECT_NE(page.find("| `facet_distance` | `surface` by cgal, `image` |"), std::string::npos);
}

TEST(Reference, HasARowForEachSettingOfPlay) {
  const std::string page = play_options_page().text;
  for (const Setting& setting : settings_table()) {
    const std::string option = cell(code(fmt::format("--{} {}", setting.name, setting.value)));
    EXPECT_EQ(rows_of(page, option), 1) << option;
    EXPECT_NE(page.find(cell(with_options_as_code(setting.meaning))), std::string::npos) << setting.name;
  }
  for (const char* other : {"--device", "--view", "--record", "--fast", "--report"})
    EXPECT_NE(page.find(std::string("| `") + other), std::string::npos) << other;
}

TEST(Reference, HasARowForEachSafetyBound) {
  const std::string page = safety_bounds_page().text;
  for_each_safety_field(SafetyOptions{}, [&](const SafetyField& field, const auto& number) {
    const std::string row = fmt::format("| `{}` | {} |", field.name, number);
    EXPECT_NE(page.find("\n" + row), std::string::npos) << row;
  });
}

TEST(Reference, HasARowForEachStatusFaultAndPhase) {
  const std::string page = status_bits_page().text;
  const auto expect = [&](const auto& names) {
    for (const auto& [value, name] : names)
      EXPECT_NE(page.find(fmt::format("| {} | `{}` |", static_cast<std::uint32_t>(value), name)),
                std::string::npos)
          << name;
  };
  expect(status_names);
  expect(fault_names);
  expect(safety_phase_names);
}

TEST(Reference, HasARowForEachTunedNumber) {
  const std::string page = tuning_page().text;
  const std::string header = text_of(palpate::test::source_file("runtime/solve/tick_tuning.h"));
  const std::regex member("\n  [^/\n]* = [^\n]*;"), row("\n\\| `[a-z_]+` \\|");
  const auto count = [](const std::string& text, const std::regex& what) {
    return std::distance(std::sregex_iterator(text.begin(), text.end(), what), {});
  };
  EXPECT_GT(count(header, member), 90);
  EXPECT_EQ(count(page, row), count(header, member));
  EXPECT_NE(page.find("| `same_place` | 1e-4 | edge | contact points nearer than this are one |"),
            std::string::npos);
  EXPECT_EQ(tuning.detection.same_place, 1e-4);
}

TEST(Reference, HasEachExitStatus) {
  const std::string page = exit_statuses_page().text;
  for (const ExitCode status : {exit_ok, exit_input_error, exit_usage, exit_differs, exit_interrupted})
    EXPECT_EQ(rows_of(page, std::to_string(status)), 1) << status;
}

TEST(Reference, ReadsMembersAsTheirHeaderDeclaresThem) {
  const std::vector<Declaration> header = declarations_of("docs/describe/header_members.h");
  const std::vector<Member>& members = declaration(header, "Member").members;
  ASSERT_EQ(members.size(), 4U);
  EXPECT_EQ(members[0].type, "std::string");
  EXPECT_EQ(members[0].name, "type");
  EXPECT_EQ(members[0].comment, "empty for an enumerator");
  EXPECT_THROW(static_cast<void>(declaration(header, "Nothing")), Error);
}

TEST(Reference, BreaksParagraphsAlone) {
  const std::string words = "eleven byte", row = "| " + std::string(200, 'x') + " |";
  std::string paragraph = words;
  for (int k = 0; k < 12; ++k) paragraph += " " + words;
  const std::string text = with_short_lines(row + "\n\n" + paragraph + "\n\n");
  EXPECT_EQ(text.substr(0, row.size() + 2), row + "\n\n");
  EXPECT_EQ(std::ranges::count(text, '\n'), 4);
  EXPECT_LE(text.find('\n', row.size() + 2) - (row.size() + 2), 110U);
}

TEST(Reference, ShowsOptionsAsCode) {
  EXPECT_EQ(with_options_as_code("--fast or (--view), a -- b, x--y"), "`--fast` or (`--view`), a -- b, x--y");
}

TEST(Reference, EscapesBarsAndLeavesEmptyColumnsOut) {
  EXPECT_EQ(markdown_table({"a", "b", "c"}, {{"1|2", "", "3\n4"}, {"5", "", ""}}),
            "| a | c |\n|---|---|\n| 1\\|2 | 3 4 |\n| 5 | |\n\n");
}

}  // namespace
}  // namespace palpate
