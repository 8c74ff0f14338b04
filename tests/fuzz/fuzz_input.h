// What the first byte of a fuzzer's input chooses.
#pragma once

#include <cstdint>

namespace palpate::test {

inline constexpr std::uint8_t raw_file = 0;  ///< the rest is a file
inline constexpr std::uint8_t some_edits =
    1;  ///< the rest chooses edits of a good file, whose checksums are then made right again

}  // namespace palpate::test
