#include <algorithm>
#include <cctype>
#include <sstream>

#include "base/command_pages.h"

namespace palpate {
namespace {

/// Text of one line as roff takes it for itself.
std::string plain(const std::string& text) {
  std::string result;
  for (const char letter : text) {
    if (letter == '\\') {
      result += "\\e";
    } else if (letter == '-') {
      result += "\\-";
    } else if (letter == '\'') {
      result += "\\(aq";
    } else {
      result += letter;
    }
  }
  return result.starts_with('.') ? "\\&" + result : result;
}

std::string bold(const std::string& text) {
  return "\\fB" + plain(text) + "\\fR";
}

std::string italic(const std::string& text) {
  return "\\fI" + plain(text) + "\\fR";
}

/// A long value, which may go on in the next line behind each bar.
std::string breakable(std::string text) {
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 1))
    text.insert(at + 1, "\\:");
  return text;
}

std::string capitals(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
  return text;
}

/// A sentence of a text that has neither capital nor full stop.
std::string sentence(std::string text) {
  if (text.empty()) return text;
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return plain(text) + (text.ends_with('.') ? "" : ".");
}

std::string entry(const ArgumentText& argument) {
  std::string names;
  const bool is_option = argument.names.front().starts_with('-');
  for (const std::string& name : argument.names)
    names += (names.empty() ? "" : ", ") + (is_option ? bold(name) : italic(name));
  if (!argument.value.empty()) names += " " + breakable(italic(argument.value));
  std::string text = ".TP\n" + names + "\n" + sentence(argument.meaning) + "\n";
  if (!argument.otherwise.empty()) text += "Default: " + plain(argument.otherwise) + ".\n";
  if (argument.is_required && is_option) text += sentence("required") + "\n";
  return text;
}

std::string entries(const std::vector<ArgumentText>& arguments) {
  std::string text, rest;
  std::vector<std::string> groups;
  for (const ArgumentText& argument : arguments)
    if (std::ranges::find(groups, argument.group) == groups.end()) groups.push_back(argument.group);
  for (const std::string& group : groups) {
    std::string& part = group.empty() ? rest : text;
    if (!group.empty()) part += ".PP\n" + bold(group) + "\n";
    for (const ArgumentText& argument : arguments)
      if (argument.group == group) part += entry(argument);
  }
  return text + rest;
}

std::string synopsis(const std::string& program, const CommandText& command) {
  std::string text =
      bold(program + (program == command.name ? "" : " " + command.name)) + " [" + italic("OPTION") + "]...";
  for (const ArgumentText& argument : command.positionals) {
    const std::string name = italic(argument.names.front());
    text += argument.is_required ? " " + name : " [" + name + "]";
  }
  return text;
}

/// What stands below the options: lines that are indented are shown as they are, others are paragraphs, which
/// go on in the next line where one has no end of a sentence.
std::string footer(const std::string& text) {
  std::istringstream lines(text);
  std::string result, line;
  bool is_verbatim = false, goes_on = false;
  while (std::getline(lines, line)) {
    if (line.empty()) {
      goes_on = false;
      continue;
    }
    const bool is_indented = line.front() == ' ';
    if (is_indented != is_verbatim) result += is_indented ? ".PP\n.nf\n" : ".fi\n";
    is_verbatim = is_indented;
    if (!is_indented && !goes_on) result += ".PP\n";
    goes_on = !is_indented && !line.ends_with('.') && !line.ends_with(':');
    result += plain(line) + "\n";
  }
  return result + (is_verbatim ? ".fi\n" : "");
}

std::string command_section(const std::string& program, const CommandText& command) {
  return ".SS " + command.name + "\n" + synopsis(program, command) + "\n.PP\n" + sentence(command.meaning) +
         "\n" + entries(command.positionals) + entries(command.options) + footer(command.footer);
}

/// Text below a heading, which begins a paragraph itself.
std::string behind_heading(const std::string& text) {
  const std::string paragraph = ".PP\n";
  return text.starts_with(paragraph) ? text.substr(paragraph.size()) : text;
}

}  // namespace

std::string man_page(const CommandText& program, const std::string& version,
                     const std::vector<std::string>& see_also) {
  // No date: equal sources make equal pages.
  std::string text = ".TH " + capitals(program.name) + " 1 \"\" \"Palpate " + version +
                     "\" \"User Commands\"\n.nh\n.ad l\n.SH NAME\n" + plain(program.name) + " \\- ";
  const std::size_t end = program.meaning.find('.');
  std::string what = program.meaning.substr(0, end);
  what.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(what.front())));
  text += plain(what) + "\n.SH SYNOPSIS\n" + synopsis(program.name, program) + "\n";
  for (const CommandText& command : program.commands)
    text += ".br\n" + synopsis(program.name, command) + "\n";
  text += ".SH DESCRIPTION\n" + plain(program.meaning) + "\n";
  if (!program.positionals.empty()) text += entries(program.positionals);
  text +=
      footer(program.footer) + ".SH OPTIONS\n" + behind_heading(entries(program.options)) + ".SH COMMANDS\n";
  for (const CommandText& command : program.commands) text += command_section(program.name, command);
  text += ".SH SEE ALSO\n";
  for (const std::string& page : see_also)
    text += ".BR " + plain(page) + " (1)" + (page == see_also.back() ? "\n" : ",\n");
  return text;
}

}  // namespace palpate
