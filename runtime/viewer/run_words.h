// JSON messages from the runtime to a page (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// Role of a page in its run.
struct PageRole {
  bool is_controller = false;
  bool controlled = false;                     ///< true if any page has control
  std::size_t pages = 0;                       ///< number of pages that watch
  std::optional<std::int64_t> own_frame = {};  ///< frame of a recording that it sees by itself
};

/// First message to a page. `mode`: live, replay or file. `has_book`: the page's help can open the book.
std::string hello_word(const char* mode, std::uint64_t page, bool has_book = false);

/// Members `what`, `where` and `hint` of an error message.
nlohmann::json error_members(const Error& error);

/// Message for an Error, with its kind if it is a PageError. `about`: the page's message that failed.
std::string error_word(const std::string& about, const Error& error);

/// Ticks per second if a run does not state them.
inline constexpr double usual_rate = 1000.0;

/// Message `state`: the members common to all pages, to which each page's own are added.
class StateWord {
 public:
  /// Throws Error if the text is not a JSON object.
  explicit StateWord(const std::string& json);

  /// `times` of a replay's frames, which a page needs once; null if absent. They are not part of the state
  /// itself.
  [[nodiscard]] const nlohmann::json& times() const noexcept { return times_; }
  [[nodiscard]] double rate() const;  ///< ticks per second

  /// Returns the message with the page's own members. The pointer belongs to this page if the run has one and
  /// the page controls it.
  [[nodiscard]] std::string for_page(std::uint32_t scene, const PageRole& role,
                                     const nlohmann::json& times) const;

 private:
  nlohmann::json members_;
  nlohmann::json times_;
};

}  // namespace palpate
