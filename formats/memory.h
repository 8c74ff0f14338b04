// How much memory there is.
#pragma once

#include <cstdint>

namespace palpate {

/// Memory that can be had without swapping, as the kernel estimates it (MemAvailable) [bytes]; 0 when it does
/// not say.
std::int64_t available_memory();

}  // namespace palpate
