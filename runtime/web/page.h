// The viewer's page, as it stands in the program.
#pragma once

#include <string_view>

namespace palpate {

/// One HTML file with its scripts and styles, UTF-8; needs nothing else from the network.
[[nodiscard]] std::string_view viewer_page() noexcept;

/// Those scripts and styles as sources of a content security policy: 'sha256-...' 'sha256-...'. 'none' where
/// the program was built without its page.
[[nodiscard]] std::string_view viewer_page_sources() noexcept;

}  // namespace palpate
