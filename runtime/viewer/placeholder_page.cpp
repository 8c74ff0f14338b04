// In place of runtime/web where that is not built.
#include "runtime/viewer/page.h"

namespace palpate {

std::string_view viewer_page() noexcept {
  return "<!doctype html><title>Palpate</title><p>This build has no viewer's page.</p>\n";
}

}  // namespace palpate
