// Viewer messages stored in a page, in place of a socket.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace palpate {

/// Collects messages of web/PROTOCOL.md; a page that contains them plays them by itself. Each is stored as
/// u32 length, u32 kind (0 text, 1 binary), payload.
class PageArchive {
 public:
  void add_text(std::string_view json) { add(json, 0); }
  void add_binary(std::string_view bytes) { add(bytes, 1); }

  [[nodiscard]] std::size_t bytes() const noexcept { return messages_.size(); }

  /// Returns `page` with all messages: deflated, as base64, in a script element "palpate-session" that
  /// browsers do not execute.
  [[nodiscard]] std::string page(std::string_view page) const;

 private:
  void add(std::string_view payload, unsigned kind);

  std::string messages_;
};

}  // namespace palpate
