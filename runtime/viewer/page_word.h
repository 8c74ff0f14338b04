// What a page says (web/PROTOCOL.md).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// No word of a page is longer [bytes].
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

/// What a word is called in messages: its `type`.
const char* name_of(const PageWord& word) noexcept;

/// Only a word that the protocol has, with all its members and no others, with finite positions of at most
/// 1e6 m and unit quaternions (to 1 %, made exact), is one. Else nothing, and `problem` says why in ASCII.
std::optional<PageWord> parse_page_word(std::string_view text, std::string& problem);

}  // namespace palpate
