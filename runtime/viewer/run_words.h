// The JSON that the runtime says to a page (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "meshes/error.h"

namespace palpate {

/// What a page is to the run.
struct PageRole {
  bool is_controller = false;
  bool controlled = false;  ///< whether any page is
  std::size_t pages = 0;    ///< all that watch
};

/// The first message of all. `mode`: live, replay or file.
std::string hello_word(const char* mode, std::uint64_t page);

/// `about`: the word of the page that could not be.
std::string error_word(const std::string& about, const std::string& message, const std::string& hint);
std::string error_word(const std::string& about, const Error& error);

/// The members of the message `state` that are the run's.
class RunState {
 public:
  /// Throws Error when the text is not a JSON object.
  explicit RunState(const std::string& json);

  /// `times` of a replay's frames, which a page needs once, null without; the state itself is without.
  [[nodiscard]] const nlohmann::json& times() const noexcept { return times_; }
  [[nodiscard]] double rate() const;  ///< ticks a second; 1000 where it is not said

  /// With the page's own members. The pointer is this page's where the run has one and the page controls.
  [[nodiscard]] std::string for_page(std::uint32_t scene, const PageRole& role,
                                     const nlohmann::json& times) const;

 private:
  nlohmann::json members_;
  nlohmann::json times_;
};

}  // namespace palpate
