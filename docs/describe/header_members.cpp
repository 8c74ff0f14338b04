#include "docs/describe/header_members.h"

#include <algorithm>
#include <regex>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/regular_file.h"

namespace palpate {
namespace {

void add_words(std::string& text, const std::string& words) {
  if (words.empty()) return;
  text += (text.empty() ? "" : " ") + words;
}

/// Code and comment of a line.
struct Line {
  std::string code;
  std::string comment;
  bool is_trailing = false;  ///< the comment is of what stands before it: ///<
};

std::string trimmed(const std::string& text) {
  return std::regex_replace(text, std::regex("^\\s+|\\s+$"), "");
}

Line split_line(const std::string& text) {
  const std::size_t slashes = text.find("///");
  if (slashes == std::string::npos) return {trimmed(text.substr(0, text.find("//"))), "", false};
  const bool trailing = text.substr(slashes, 4) == "///<";
  return {trimmed(text.substr(0, slashes)), trimmed(text.substr(slashes + (trailing ? 4 : 3))), trailing};
}

/// Reads the lines of a header one after the other.
class HeaderReader {
 public:
  void read(const std::string& text) {
    const Line line = split_line(text);
    if (line.code.empty() && !line.is_trailing) {
      line.comment.empty() ? above_.clear() : add_words(above_, line.comment);
    } else if (line.code.empty()) {
      if (last_ != nullptr) add_words(last_->comment, line.comment);
    } else {
      read_code(line);
    }
  }

  [[nodiscard]] std::vector<Declaration> take() { return std::move(all_); }

 private:
  void read_code(const Line& line) {
    std::smatch found;
    static const std::regex begin(R"((?:struct|enum|enum class) (\w+)(?: : [\w:]+)? \{)");
    statement_ += (statement_.empty() ? "" : " ") + line.code;
    if (std::regex_match(statement_, found, begin)) {
      all_.push_back({found[1], std::exchange(above_, ""), {}});
      inside_ = true;
    } else if (inside_ && statement_.starts_with("}")) {
      inside_ = false;
    } else if (inside_ && !std::regex_search(statement_, std::regex("[;,{}]$"))) {
      return;  // it goes on
    } else if (inside_) {
      read_member(line.comment);
    }
    statement_.clear();
    if (!inside_) last_ = nullptr;
    above_.clear();
  }

  void read_member(const std::string& comment) {
    std::smatch found;
    static const std::regex member(R"(([\w:<>, ]+[\w>]) (\w+)((?:\[\w*\])*)(?: = (.*)|(\{.*\}))?;)");
    static const std::regex enumerator(R"((\w+)(?: = (.*))?,?)");
    Member read;
    if (std::regex_match(statement_, found, member)) {
      read = {found[1].str() + found[3].str(), found[2], found[4], ""};
    } else if (std::regex_match(statement_, found, enumerator)) {
      read = {"", found[1], found[2], ""};
      if (read.value.ends_with(',')) read.value.pop_back();
    } else {
      last_ = nullptr;  // a function
      return;
    }
    read.comment = std::exchange(above_, "");
    add_words(read.comment, comment);
    all_.back().members.push_back(read);
    last_ = &all_.back().members.back();
  }

  std::vector<Declaration> all_;
  std::string above_;      // doc comment before what comes next
  std::string statement_;  // code that is not at its end
  Member* last_ = nullptr;
  bool inside_ = false;
};

}  // namespace

std::vector<Declaration> declarations_of(const std::filesystem::path& header) {
  std::istringstream lines(
      read_all(std::filesystem::path(PALPATE_SOURCE_DIR) / header, "build palpate-describe anew"));
  HeaderReader reader;
  for (std::string line; std::getline(lines, line);) reader.read(line);
  return reader.take();
}

const Declaration& declaration(const std::vector<Declaration>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Declaration::name);
  if (found == all.end()) throw Error("has no declaration of " + name, "the header", "name another one");
  return *found;
}

}  // namespace palpate
