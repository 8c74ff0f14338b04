// What the first byte of a fuzzer's input chooses.
#pragma once

#include <cstdint>

namespace palpate::test {

inline constexpr std::uint8_t raw_file = 0;  ///< the rest is a file
/// The rest chooses edits of a good file, whose checksums are then made right again.
inline constexpr std::uint8_t some_edits = 1;
inline constexpr std::uint8_t some_plane_edits = 2;  ///< the same of a file of quads in the plane

}  // namespace palpate::test
