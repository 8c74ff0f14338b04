// File of the gallery that is shown.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/file_io.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/push/other_program.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Shows one file at a time, by a palpate-runtime of its own at a port of its own: a body is played, a
/// recording is viewed, and a source is baked first. A body that is too large or crashes its program thus
/// leaves the gallery intact. A thread watches the program; no other thread waits for it.
class OpenedItem {
 public:
  /// `program`: palpate-runtime; this one if empty. A program that ignores SIGTERM for `time_to_end` is
  /// killed.
  explicit OpenedItem(std::filesystem::path program = {},
                      std::chrono::milliseconds time_to_end = std::chrono::seconds(10));
  ~OpenedItem();  ///< ends the shown item and waits for its end
  OpenedItem(const OpenedItem&) = delete;
  OpenedItem& operator=(const OpenedItem&) = delete;

  /// File to show.
  struct Wanted {
    std::filesystem::path folder;  ///< folder of the gallery; recordings and bodies are written there
    std::string name;              ///< file name in the folder
    ViewerOptions gallery;         ///< options of the gallery itself
  };

  /// Shows a file at one of the next ports, once the one shown before has ended: two large bodies may not fit
  /// into memory.
  void open(Wanted wanted);
  /// Ends the shown item.
  void close();

  /// Address of the shown item.
  struct Page {
    std::uint16_t port = 0;
    std::string token;  ///< from random_token
  };

  /// Progress of the shown item.
  struct State {
    std::string name;
    std::deque<std::string> said;  ///< last lines of its program, printable
    std::optional<Page> page;      ///< empty until it is served
    bool has_ended = false;        ///< `said` has the reason if it was never served
  };
  [[nodiscard]] std::optional<State> state() const;  ///< empty: nothing is open

 private:
  struct Running;

  void order(std::optional<Wanted> wanted);
  void work();
  bool take_order(Running& running);
  void listen(Running& running);
  void hear_printed(Running& running);
  void hear_told(Running& running);
  void hear(const Running& running, const std::string& line);
  void end(Running& running);

  OtherProgram::Start start_of(const Wanted& wanted) const;

  std::filesystem::path program_;
  std::chrono::milliseconds time_to_end_;
  FileDescriptor wake_;
  mutable std::mutex mutex_;      // guards the following
  std::int64_t ordered_ = 0;      // number of calls of open and close
  std::optional<Wanted> wanted_;  // not yet started
  std::optional<State> state_;
  bool is_over_ = false;
  std::thread thread_;
};

/// Parses the page from a line of JSON (tell_address); empty for any other text.
[[nodiscard]] std::optional<OpenedItem::Page> page_told(const std::string& line);

}  // namespace palpate
