#include "runtime/gallery/opened_item.h"

#include <fmt/core.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "runtime/serving/admission.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kept_lines = 12;
constexpr std::size_t longest_line = 1 << 16;  // [bytes]
constexpr int last_reads = 64;                 // reads of the remaining output of a program that has ended

/// Returns one of the next ports, so that pages find their stored settings under the same address; else any
/// free one.
std::uint16_t port_beside(ViewerOptions options) {
  constexpr int tries = 10;
  for (int k = 0; k < tries && options.port < UINT16_MAX; ++k) {
    ++options.port;
    try {
      const ViewerPort free(options);
      return options.port;
    } catch (const Error&) {  // used by another program
    }
  }
  return 0;
}

bool is_readable(int descriptor) {
  pollfd one = {.fd = descriptor, .events = POLLIN, .revents = 0};
  return ::poll(&one, 1, 0) > 0;
}

}  // namespace

std::optional<OpenedItem::Page> page_told(const std::string& line) {
  const nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object() || !json.contains("port") || !json["port"].is_number_unsigned() ||
      !json.contains("token") || !json["token"].is_string())
    return std::nullopt;
  const auto port = json["port"].get<std::uint64_t>();
  const auto token = json["token"].get<std::string>();
  if (port < 1 || port > UINT16_MAX || !is_token(token)) return std::nullopt;
  return OpenedItem::Page{static_cast<std::uint16_t>(port), token};
}

/// Running program, with the state of the thread that watches it.
struct OpenedItem::Running {
  std::unique_ptr<OtherProgram> program;
  std::int64_t order = 0;  // order that started it
  std::optional<Clock::time_point> kill_at;
  bool prints = false;
  std::string printed, told;  // incomplete lines
};

OpenedItem::OpenedItem(std::filesystem::path program, std::chrono::milliseconds time_to_end)
    : program_(std::move(program)),
      time_to_end_(time_to_end),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd") {
  if (wake_.get() < 0)
    throw Error("no file descriptor is left", "gallery", "close other programs and try again");
  thread_ = std::thread([this] { work(); });
}

OpenedItem::~OpenedItem() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  close();
  thread_.join();
}

void OpenedItem::open(Wanted wanted) {
  order(std::move(wanted));
}

void OpenedItem::close() {
  order({});
}

OtherProgram::Start OpenedItem::start_of(const Wanted& wanted) const {
  const auto& [folder, name, gallery] = wanted;
  const std::string file = (folder / name).string();  // full path: pages store their settings under it
  const GalleryKind kind = *gallery_kind(name);
  std::vector<std::string> words = {kind == GalleryKind::recording ? "view" : "push", file};
  if (kind == GalleryKind::source)
    words.insert(words.end(), {"--output", (folder / baked_name(name)).string(), "--keep"});
  words.insert(words.end(), {"--view-address", fmt::format("{}:{}", gallery.address, port_beside(gallery)),
                             "--view-fd", std::to_string(told_descriptor)});
  if (gallery.framed) words.emplace_back("--view-framed");
  return {.program = program_.empty() ? std::filesystem::read_symlink("/proc/self/exe") : program_,
          .arguments = words,
          .read = OtherProgram::Stream::errors,
          .folder = folder,
          .has_terminal = false,
          .tells = true};
}

void OpenedItem::order(std::optional<Wanted> wanted) {
  const std::lock_guard lock(mutex_);
  ++ordered_;
  state_.reset();
  if (wanted) state_ = State{.name = wanted->name, .said = {}, .page = {}};
  wanted_ = std::move(wanted);
  const std::uint64_t one = 1;
  static_cast<void>(write_all(wake_.get(), {reinterpret_cast<const char*>(&one), sizeof one}));
}

std::optional<OpenedItem::State> OpenedItem::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

/// Main function of the thread; the program ends with it.
void OpenedItem::work() {
  Running running;
  while (take_order(running)) listen(running);
}

/// Ends the program of the old order and starts that of the new one. Returns false when the thread must end.
bool OpenedItem::take_order(Running& running) {
  std::optional<Wanted> wanted;
  {
    const std::lock_guard lock(mutex_);
    const bool is_wanted = running.order == ordered_;
    if (running.program && is_wanted) return true;
    if (running.program) {
      if (!running.kill_at) running.program->send(SIGTERM);
      if (!running.kill_at) running.kill_at = Clock::now() + time_to_end_;
      return true;
    }
    if (is_over_) return false;
    running = {};
    running.order = ordered_;
    wanted = std::exchange(wanted_, std::nullopt);
  }
  if (!wanted) return true;
  try {
    running.program = std::make_unique<OtherProgram>(start_of(*wanted));
    running.prints = true;
  } catch (...) {
    hear(running, to_text(handled_error("gallery", "close other programs")));
    end(running);
  }
  return true;
}

/// Waits for an order, or for the program's output or end.
void OpenedItem::listen(Running& running) {
  const OtherProgram* const program = running.program.get();
  std::array<pollfd, 3> heard = {
      {{.fd = wake_.get(), .events = POLLIN, .revents = 0},
       {.fd = running.prints ? program->printed() : -1, .events = POLLIN, .revents = 0},
       {.fd = program ? program->told() : -1, .events = POLLIN, .revents = 0}}};
  int wait = -1;  // [ms]
  if (running.kill_at) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(*running.kill_at - Clock::now());
    wait = static_cast<int>(std::max<std::int64_t>(left.count(), 0));
    if (wait == 0) running.program->send(SIGKILL);
    if (wait == 0) wait = -1;  // killed: it ends at once
  }
  if (::poll(heard.data(), heard.size(), wait) <= 0) return;
  if (heard[0].revents != 0) {
    std::array<std::byte, sizeof(std::uint64_t)> count{};
    [[maybe_unused]] const ssize_t seen = ::read(wake_.get(), count.data(), count.size());
  }
  if (heard[1].revents != 0) hear_printed(running);
  if (heard[2].revents != 0) hear_told(running);
}

void OpenedItem::hear_printed(Running& running) {
  const std::string text = running.program->read();
  running.prints = !text.empty();
  running.printed += text;
  for (std::size_t end = running.printed.find('\n'); end != std::string::npos;
       end = running.printed.find('\n')) {
    hear(running, running.printed.substr(0, end));
    running.printed.erase(0, end + 1);
  }
  const bool is_rest = !running.prints || running.printed.size() > longest_line;
  if (is_rest && !running.printed.empty()) hear(running, std::exchange(running.printed, {}));
}

/// Reads the program's pipe. The program alone holds its other end open, so end of file means that it has
/// ended.
void OpenedItem::hear_told(Running& running) {
  const std::string text = running.program->read_told();
  running.told += text;
  if (text.empty()) return end(running);
  if (running.told.size() > longest_line) running.told.clear();
  const std::size_t line = running.told.find('\n');
  if (line == std::string::npos) return;
  const std::lock_guard lock(mutex_);
  if (running.order == ordered_) state_->page = page_told(running.told.substr(0, line));
  running.told.erase(0, line + 1);
}

/// Lines of an earlier order's program go to the terminal only.
void OpenedItem::hear(const Running& running, const std::string& line) {
  std::string shown = printable(line);
  say(stderr, "{}\n", shown);
  const std::lock_guard lock(mutex_);
  if (running.order != ordered_) return;
  state_->said.push_back(std::move(shown));
  if (state_->said.size() > kept_lines) state_->said.pop_front();
}

void OpenedItem::end(Running& running) {
  for (int k = 0; k < last_reads && running.prints && is_readable(running.program->printed()); ++k)
    hear_printed(running);
  try {
    if (running.program) static_cast<void>(running.program->wait());
  } catch (const Error& error) {
    hear(running, to_text(error));
  }
  running.program.reset();
  running.prints = false;
  running.kill_at.reset();
  const std::lock_guard lock(mutex_);
  if (running.order == ordered_) state_->has_ended = true;
}

}  // namespace palpate
