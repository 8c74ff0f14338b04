// The JSON that the runtime says to a page (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// What a page is to the run.
struct PageRole {
  bool is_controller = false;
  bool controlled = false;                     ///< whether any page is
  std::size_t pages = 0;                       ///< all that watch
  std::optional<std::int64_t> own_frame = {};  ///< of a recording, where it sees another than all
};

/// The first message of all. `mode`: live, replay or file. `has_book`: the page's help can open the book.
std::string hello_word(const char* mode, std::uint64_t page, bool has_book = false);

/// What is wrong, where, and what to do about it: the members `what`, `where` and `hint`.
nlohmann::json error_members(const Error& error);

/// The message of an Error, with its kind where it is a PageError. `about`: the word of the page that could
/// not be.
std::string error_word(const std::string& about, const Error& error);

/// Ticks a second where a run does not say.
inline constexpr double usual_rate = 1000.0;

/// The message `state`: the members that are the run's, to which those of each page are added.
class StateWord {
 public:
  /// Throws Error when the text is not a JSON object.
  explicit StateWord(const std::string& json);

  /// `times` of a replay's frames, which a page needs once, null without; the state itself is without.
  [[nodiscard]] const nlohmann::json& times() const noexcept { return times_; }
  [[nodiscard]] double rate() const;  ///< ticks a second

  /// With the page's own members. The pointer is this page's where the run has one and the page controls.
  [[nodiscard]] std::string for_page(std::uint32_t scene, const PageRole& role,
                                     const nlohmann::json& times) const;

 private:
  nlohmann::json members_;
  nlohmann::json times_;
};

}  // namespace palpate
