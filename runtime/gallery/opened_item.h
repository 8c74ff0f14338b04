// The file of the gallery that is shown.
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

/// One file at a time, shown by a palpate-runtime of its own at a port of its own: a body is played, a
/// recording is viewed, and of a source a body is made first. So a body that is large, or ends badly, leaves
/// the gallery as it is. A thread looks after that program; no other one ever waits for it.
class OpenedItem {
 public:
  /// `program` is palpate-runtime: this one where it is empty. One that does not heed SIGTERM in
  /// `time_to_end` is killed.
  explicit OpenedItem(std::filesystem::path program = {},
                      std::chrono::milliseconds time_to_end = std::chrono::seconds(10));
  ~OpenedItem();  ///< ends what is shown, and waits for that
  OpenedItem(const OpenedItem&) = delete;
  OpenedItem& operator=(const OpenedItem&) = delete;

  /// A file to show.
  struct Wanted {
    std::filesystem::path folder;  ///< of the gallery: what is recorded and made lands there
    std::string name;              ///< of a file of it
    ViewerOptions gallery;         ///< as the gallery itself is served
  };

  /// Shows it, at one of the next ports, once what was shown before has ended: two large bodies at once are
  /// too much.
  void open(Wanted wanted);
  /// Ends what is shown.
  void close();

  /// Where it is shown.
  struct Page {
    std::uint16_t port = 0;
    std::string token;  ///< as random_token gives it
  };

  /// How far it is.
  struct State {
    std::string name;
    std::deque<std::string> said;  ///< the last lines of its program, fit to be shown
    std::optional<Page> page;      ///< none yet
    bool has_ended = false;        ///< `said` tells why, where it has never been shown
  };
  [[nodiscard]] std::optional<State> state() const;  ///< nothing: none is open

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
  mutable std::mutex mutex_;      // of what follows
  std::int64_t ordered_ = 0;      // counts calls of open and close
  std::optional<Wanted> wanted_;  // not begun yet
  std::optional<State> state_;
  bool is_over_ = false;
  std::thread thread_;
};

/// The page that a line of JSON tells of (tell_address); nothing where it is another text.
[[nodiscard]] std::optional<OpenedItem::Page> page_told(const std::string& line);

}  // namespace palpate
