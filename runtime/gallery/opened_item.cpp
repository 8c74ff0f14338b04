#include "runtime/gallery/opened_item.h"

#include <fmt/core.h>

#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/program.h"

namespace palpate {
namespace {

constexpr std::size_t kept_lines = 12;
constexpr std::string_view before_url = "open ";
constexpr std::string_view after_url = " in a browser";

std::vector<std::string> arguments_for(const std::filesystem::path& folder, const std::string& name,
                                       const ViewerOptions& options) {
  const std::string file = (folder / name).string();  // whole: pages keep their looks by it
  std::vector<std::string> words;
  switch (*gallery_kind(name)) {
    case GalleryKind::body:
    case GalleryKind::source:
      words = {"push", file};
      break;
    case GalleryKind::recording:
      words = {"view", file};
      break;
  }
  words.insert(words.end(), {"--view-address", fmt::format("{}:{}", options.address, options.port)});
  if (options.framed) words.emplace_back("--view-framed");
  return words;
}

/// The address in "open URL in a browser; …"; empty in every other line.
std::string url_in(std::string_view line) {
  const std::size_t end = line.find(after_url);
  if (!line.starts_with(before_url) || end == std::string_view::npos) return "";
  return std::string(line.substr(before_url.size(), end - before_url.size()));
}

}  // namespace

OpenedItem::OpenedItem(const std::filesystem::path& folder, std::string name, const ViewerOptions& options) {
  OtherProgram::Start start{.program = std::filesystem::read_symlink("/proc/self/exe"),
                            .arguments = arguments_for(folder, name, options),
                            .read = OtherProgram::Stream::errors,
                            .folder = folder,
                            .has_terminal = false};
  state_.name = std::move(name);
  watcher_ = std::thread([this, start = std::move(start)] { watch(start); });
}

OpenedItem::~OpenedItem() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    if (program_) program_->end();
  }
  watcher_.join();
}

OpenedItem::State OpenedItem::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

bool OpenedItem::begin(std::unique_ptr<OtherProgram> program) {
  const std::lock_guard lock(mutex_);
  program_ = std::move(program);
  return !is_over_;
}

/// The watcher's thread, with which the program ends.
void OpenedItem::watch(const OtherProgram::Start& start) {
  try {
    if (begin(std::make_unique<OtherProgram>(start))) {
      std::string rest;
      for (std::string text = program_->read(); !text.empty(); text = program_->read()) {
        rest += text;
        for (std::size_t end = rest.find('\n'); end != std::string::npos; end = rest.find('\n')) {
          hear(rest.substr(0, end));
          rest.erase(0, end + 1);
        }
      }
      if (!rest.empty()) hear(rest);
    } else {
      program_->end();
    }
    static_cast<void>(program_->wait());
  } catch (const Error& error) {
    hear(to_text(error));
  }
  const std::lock_guard lock(mutex_);
  state_.has_ended = true;
}

void OpenedItem::hear(const std::string& line) {
  const std::string url = url_in(line);
  if (url.empty()) say(stderr, "{}\n", line);
  const std::lock_guard lock(mutex_);
  if (!url.empty()) {
    state_.url = url;
    return;
  }
  state_.said.push_back(line);
  if (state_.said.size() > kept_lines) state_.said.pop_front();
}

}  // namespace palpate
