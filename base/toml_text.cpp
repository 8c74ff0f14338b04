#include "base/toml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/error.h"
#include "base/words.h"

namespace palpate {
namespace {

constexpr std::size_t most_bytes = 16'000'000;
// toml++ recurses once for every part of a key and every nested value when it destroys a table, and looks
// through all tables and dotted keys so far for each of them.
constexpr std::size_t most_parts = 16;
constexpr std::size_t most_nested = 32;
constexpr std::size_t most_tables = 50'000;  // tables and dots in keys
constexpr std::size_t longest_message = 200;

/// Scanner of TOML text that follows its grammar and builds nothing. It may misread invalid TOML, but only
/// after the place where the parser stops.
class TomlScan {
 public:
  TomlScan(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  void run() {
    if (text_.size() > most_bytes) {
      throw Error("the file has " + std::to_string(text_.size()) + " bytes", file_,
                  "a TOML file here has at most " + std::to_string(most_bytes) +
                      " bytes; give large geometry in a file of its own");
    }
    while (at_ < text_.size()) {
      step(text_[at_]);
    }
  }

 private:
  void step(char c) {
    switch (c) {
      case '"':
      case '\'':
        skip_string(c);
        return;
      case '#':
        at_ = std::min(text_.find('\n', at_), text_.size());
        return;
      case '\n':
        if (open_.empty()) begin_key();
        break;
      case '.':
        if (in_key_) add_dot();
        break;
      case '=':
        in_key_ = false;
        break;
      case ',':
        in_key_ = false;
        if (!open_.empty() && open_.back() == '{') begin_key();
        break;
      case '[':
      case '{':
        open(c);
        break;
      case ']':
      case '}':
        if (!in_key_ || !open_.empty()) close();
        break;
      default:
        break;
    }
    ++at_;
  }

  void begin_key() {
    in_key_ = true;
    parts_ = 1;
  }

  void add_dot() {
    if (++parts_ > most_parts) {
      fail("a key has more than " + std::to_string(most_parts) + " parts", "write fewer dots");
    }
    count("dots in keys", ++dots_);
  }

  void open(char c) {
    if (in_key_ && open_.empty()) {  // [table], [[list]]
      if (!text_.substr(at_).starts_with("[[")) count("tables", ++tables_);
      return;
    }
    open_.push_back(c);
    if (open_.size() > most_nested) {
      fail("values are nested more than " + std::to_string(most_nested) + " deep", "write fewer brackets");
    }
    in_key_ = false;
    if (c == '{') {
      count("tables", ++tables_);
      begin_key();
    }
  }

  void close() {
    if (!open_.empty()) open_.pop_back();
    in_key_ = false;
  }

  void count(const char* things, std::size_t number) const {
    if (number > most_tables) {
      fail("the file has more than " + std::to_string(most_tables) + " " + things,
           "a region in place of single entries, or geometry in a file of its own, says the same");
    }
  }

  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool is_long = text_.substr(at_).starts_with(three);
    at_ += is_long ? 3 : 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\\' && quote == '"') {
        at_ += 2;
      } else if (is_long ? text_.substr(at_).starts_with(three) : c == quote) {
        at_ += is_long ? 3 : 1;
        while (is_long && at_ < text_.size() && text_[at_] == quote)
          ++at_;  // up to two quotes before the end
        return;
      } else if (c == '\n' && !is_long) {
        return;  // not valid
      } else {
        ++at_;
      }
    }
  }

  [[noreturn]] void fail(const std::string& what, const std::string& hint) const {
    const auto before = text_.substr(0, at_);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    throw Error(what, file_ + ":" + std::to_string(line), hint);
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::vector<char> open_;  // brackets of values
  bool in_key_ = true;
  std::size_t parts_ = 1, dots_ = 0, tables_ = 0;
};

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& file) {
  TomlScan(text, file).run();
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw Error("not valid TOML: " + shortened(error.description(), longest_message),
                file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
                "see https://toml.io for the syntax");
  }
}

std::string toml_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x20 || code == 0x7F) {
      result += fmt::format("\\u{:04X}", code);
      continue;
    }
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

}  // namespace palpate
