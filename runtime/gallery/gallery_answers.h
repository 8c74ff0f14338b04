// What the gallery answers by HTTP.
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

/// The most that a file may have that is dropped on the page [bytes].
inline constexpr std::uint64_t largest_drop = std::uint64_t{8} << 30U;

/// A part of a request's target, `name` of ?name=...&..., with its escapes undone. Empty where it is not
/// there.
[[nodiscard]] std::string query_value(std::string_view target, std::string_view name);

/// The folder and what of it is shown. For the server's thread.
class GalleryAnswers {
 public:
  GalleryAnswers(std::filesystem::path folder, ViewerOptions options)
      : folder_(std::move(folder)), options_(std::move(options)) {}

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

  /// Why a request is not answered. The page, which is the same for everybody, needs no token.
  [[nodiscard]] static std::optional<Response> refusal(const RequestHeader& request,
                                                       const ServedAddress& served);
  [[nodiscard]] static bool wants_page(const RequestHeader& request);
  [[nodiscard]] static Response page(const RequestHeader& request, const ServedAddress& served);
  /// Whether it asks for what takes a look into a file.
  [[nodiscard]] static bool wants_scene(const RequestHeader& request);
  /// To that. Waits for the look; any thread may.
  [[nodiscard]] Response scene(const RequestHeader& request) const;
  /// Whether it brings a file, whose bytes are to be read.
  [[nodiscard]] static bool brings_file(const RequestHeader& request);
  /// Why the file that it brings is not taken.
  [[nodiscard]] static std::optional<Response> drop_refusal(const RequestHeader& request);
  /// The file has come, under a temporary name in the folder: it is given the name that the request has for
  /// it, or one like it that is free. Throws Error.
  [[nodiscard]] Response keep_file(const RequestHeader& request,
                                   const std::filesystem::path& temporary) const;
  /// To all other requests.
  [[nodiscard]] Response answer(const RequestHeader& request, const ServedAddress& served);

 private:
  [[nodiscard]] Response items() const;
  [[nodiscard]] Response open(const std::string& name, std::uint16_t port);
  [[nodiscard]] Response close();
  [[nodiscard]] Response opened() const;
  /// The file of this name, as the list has it; nothing where there is none.
  [[nodiscard]] std::optional<std::string> find(const std::string& name) const;

  std::filesystem::path folder_;
  ViewerOptions options_;
  OpenedItem opened_;
};

}  // namespace palpate
