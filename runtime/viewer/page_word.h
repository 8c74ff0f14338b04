// Messages from a page (web/PROTOCOL.md).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// Largest size of a page's message [byte].
inline constexpr std::size_t longest_page_word = 16384;

struct PointWord {
  PointerPose wanted;
};
struct PauseWord {
  bool paused;
};
struct StepWord {};
struct ResetWord {};
struct AcknowledgeWord {};
struct ChangeWord {
  SettingsChange settings;
};
struct RecordWord {
  bool on;
};
struct ControlWord {
  bool take;
};
struct SeekWord {
  std::int64_t frame;
};
struct FollowWord {};

using PageWord = std::variant<PointWord, PauseWord, StepWord, ResetWord, AcknowledgeWord, ChangeWord,
                              RecordWord, ControlWord, SeekWord, FollowWord>;

/// Returns the message's `type`.
const char* name_of(const PageWord& word) noexcept;

/// Parses a message of the protocol: all its members and no others, finite positions of at most 1e6 m, unit
/// quaternions (to 1 %, normalised). Otherwise returns nothing and writes the reason, in ASCII, to `problem`.
std::optional<PageWord> parse_page_word(std::string_view text, std::string& problem);

}  // namespace palpate
