// How much memory there is.
#pragma once

#include <cstdint>
#include <memory>

namespace palpate {

/// Memory that can be had without swapping, as the kernel estimates it (MemAvailable) [bytes]; 0 when it does
/// not say.
std::int64_t available_memory();

/// Zeroed memory that starts on a huge page, on huge pages where the kernel gives them: a tick touches few
/// bytes on each of many rows. Null when there is none.
std::shared_ptr<void> map_memory(std::int64_t bytes);

}  // namespace palpate
