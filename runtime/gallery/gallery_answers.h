// HTTP answers of the gallery.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/gallery/opened_item.h"
#include "runtime/serving/http_guard.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Largest size of a file dropped on the page [byte].
inline constexpr std::uint64_t largest_drop = std::uint64_t{8} << 30U;

/// Returns a parameter of a request's target, `name` of ?name=...&..., unescaped. Empty if it is absent.
[[nodiscard]] std::string query_value(std::string_view target, std::string_view name);

/// Contents of the folder and the item that is shown. For the server's thread.
class GalleryAnswers {
 public:
  GalleryAnswers(std::filesystem::path folder, ViewerOptions options)
      : folder_(std::move(folder)), options_(std::move(options)) {}

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

  /// Refusal of a request; empty if it is accepted. The page itself is public and needs no token.
  [[nodiscard]] static std::optional<Response> refusal(const RequestHeader& request,
                                                       const ServedAddress& served);
  [[nodiscard]] static bool wants_page(const RequestHeader& request);
  [[nodiscard]] static Response page(const RequestHeader& request, const ServedAddress& served);
  /// True for a request that requires reading a file.
  [[nodiscard]] static bool wants_scene(const RequestHeader& request);
  /// Answers such a request. Waits for the file; for any thread.
  [[nodiscard]] Response scene(const RequestHeader& request) const;
  /// True for a request that uploads a file, whose bytes must be read.
  [[nodiscard]] static bool brings_file(const RequestHeader& request);
  /// Refusal of the uploaded file; empty if it is accepted.
  [[nodiscard]] static std::optional<Response> drop_refusal(const RequestHeader& request);
  /// Renames the uploaded file, complete under a temporary name in the folder, to the requested name or a
  /// similar free one. Throws Error.
  [[nodiscard]] Response keep_file(const RequestHeader& request,
                                   const std::filesystem::path& temporary) const;
  /// Answers all other requests.
  [[nodiscard]] Response answer(const RequestHeader& request, const ServedAddress& served);

 private:
  [[nodiscard]] Response items() const;
  [[nodiscard]] Response open(const std::string& name, std::uint16_t port);
  [[nodiscard]] Response close();
  [[nodiscard]] Response opened() const;
  /// Returns the file with this name from the list; empty if there is none.
  [[nodiscard]] std::optional<std::string> find(const std::string& name) const;

  std::filesystem::path folder_;
  ViewerOptions options_;
  OpenedItem opened_;
};

}  // namespace palpate
