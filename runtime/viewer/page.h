// The viewer's page.
#pragma once

#include <string_view>

namespace palpate {

/// HTML that holds all it needs.
std::string_view viewer_page();

}  // namespace palpate
