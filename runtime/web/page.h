// The viewer's page, as it stands in the program.
#pragma once

#include <string_view>

namespace palpate {

/// One HTML file with its scripts and styles, UTF-8; needs nothing else from the network.
[[nodiscard]] std::string_view viewer_page() noexcept;

}  // namespace palpate
