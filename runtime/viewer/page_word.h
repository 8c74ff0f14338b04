// Messages from a page (web/PROTOCOL.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// Largest size of a page's message [byte].
inline constexpr std::size_t longest_page_word = 16384;

struct PageWord {
  std::string type;  ///< its name in messages
  /// Asks it of the run; empty for `control` and `follow`, which are between pages.
  std::function<void(ViewedRun&)> ask{};
  bool take = false;                    ///< of `control`
  std::optional<std::int64_t> frame{};  ///< of `seek`
};

/// Parses a message of the protocol: all its members and no others, finite positions of at most 1e6 m, unit
/// quaternions (to 1 %, normalised). Otherwise returns nothing and writes the reason, in ASCII, to `problem`.
std::optional<PageWord> parse_page_word(std::string_view text, std::string& problem);

}  // namespace palpate
