// The viewer's page, embedded in the program.
#pragma once

#include <string_view>

namespace palpate {

/// Returns one HTML file with its scripts and styles, UTF-8; it needs no other file from the network.
[[nodiscard]] std::string_view viewer_page() noexcept;

/// Returns its scripts and styles as sources of a content security policy: 'sha256-...' 'sha256-...'.
[[nodiscard]] std::string_view viewer_page_sources() noexcept;

}  // namespace palpate
