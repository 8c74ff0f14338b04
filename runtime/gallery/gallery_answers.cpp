#include "runtime/gallery/gallery_answers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"
#include "base/json_text.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/gallery/gallery_scene.h"
#include "runtime/serving/admission.h"

namespace palpate {
namespace {

namespace http = boost::beast::http;
using nlohmann::json;

constexpr std::array<std::pair<GalleryKind, const char*>, 3> kind_names = {
    {{GalleryKind::body, "body"}, {GalleryKind::recording, "recording"}, {GalleryKind::source, "source"}}};

const char* name_of(GalleryKind kind) {
  for (const auto& [known, name] : kind_names)
    if (known == kind) return name;
  return "";
}

std::string_view path_of(const RequestHeader& request) {
  return split_target(text_view(request.target())).path;
}

std::string name_in(const RequestHeader& request) {
  return query_value(text_view(request.target()), "name");
}

/// True for a request that changes something.
bool is_deed(std::string_view path) {
  return path == "/open" || path == "/close" || path == "/drop";
}

Response json_answer(const json& value) {
  Response response;
  response.set(http::field::content_type, "application/json");
  response.body() = json_text(value);
  return guarded(std::move(response));
}

Response no_such(const std::string& what) {
  return guarded(plain(http::status::not_found, "There is no such " + what + "."));
}

}  // namespace

std::string query_value(std::string_view target, std::string_view name) {
  std::string_view rest = target.substr(std::min(target.find('?'), target.size()));
  while (!rest.empty()) {
    rest.remove_prefix(1);
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(part.size());
    if (part.substr(0, part.find('=')) != name || part.size() <= name.size()) continue;
    std::string value;
    const std::string_view escaped = part.substr(name.size() + 1);
    for (std::size_t k = 0; k < escaped.size(); ++k) {
      unsigned code = 0;
      const char* const digits = escaped.data() + k + 1;
      if (escaped[k] == '%' && k + 2 < escaped.size() &&
          std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
        value += static_cast<char>(code);
        k += 2;
      } else {
        value += escaped[k];
      }
    }
    return value;
  }
  return "";
}

std::optional<Response> GalleryAnswers::refusal(const RequestHeader& request, const ServedAddress& served) {
  if (std::optional<Response> refused = foreign_refusal(request, served)) return refused;
  const char* const allowed = is_deed(path_of(request)) ? "POST" : "GET";
  if (request.method() != http::string_to_verb(allowed)) return method_refusal(allowed);
  if (wants_page(request)) return std::nullopt;
  return token_refusal(request, served);
}

bool GalleryAnswers::wants_page(const RequestHeader& request) {
  return path_of(request) == "/gallery";
}

Response GalleryAnswers::page(const RequestHeader& request, const ServedAddress& served) {
  return guarded(page_answer(text_view(request[http::field::host]), ancestors(served, false), false));
}

bool GalleryAnswers::wants_scene(const RequestHeader& request) {
  return path_of(request) == "/scene";
}

bool GalleryAnswers::brings_file(const RequestHeader& request) {
  return path_of(request) == "/drop";
}

std::optional<Response> GalleryAnswers::drop_refusal(const RequestHeader& request) {
  if (gallery_kind(name_in(request))) return std::nullopt;
  return guarded(plain(http::status::unsupported_media_type,
                       "This is neither a body (.palpate.hdf), a recording (.mcap), a surface (.stl, .obj, "
                       ".ply, .off), a labelled image (.nrrd, .nii, .inr) nor a picture (.png, .pbm)."));
}

Response GalleryAnswers::keep_file(const RequestHeader& request,
                                   const std::filesystem::path& temporary) const {
  std::string name = free_name(folder_, name_in(request));
  while (!rename_new(temporary, folder_ / name)) name = free_name(folder_, name_in(request));
  return json_answer({{"name", name}});
}

Response GalleryAnswers::answer(const RequestHeader& request, const ServedAddress& served) {
  const std::string_view path = path_of(request);
  try {
    if (path == "/items") return items();
    if (path == "/open") return open(name_in(request), served.port);
    if (path == "/close") return close();
    if (path == "/opened") return opened();
  } catch (const Error& error) {
    return guarded(plain(http::status::not_found, to_text(error)));
  }
  return no_such("page");
}

Response GalleryAnswers::items() const {
  json items = json::array();
  for (const GalleryItem& item : list_gallery(folder_)) {
    items.push_back({{"name", item.name},
                     {"kind", name_of(item.kind)},
                     {"bytes", item.bytes},
                     {"modified", item.modified}});
  }
  return json_answer({{"folder", folder_.string()}, {"version", PALPATE_VERSION}, {"items", items}});
}

std::optional<std::string> GalleryAnswers::find(const std::string& name) const {
  std::error_code problem;
  if (gallery_kind(name) && std::filesystem::is_regular_file(folder_ / name, problem)) return name;
  for (const GalleryItem& item : list_gallery(folder_))
    if (json_text(json(item.name)) == json_text(json(name))) return item.name;  // name that is not UTF-8
  return std::nullopt;
}

Response GalleryAnswers::scene(const RequestHeader& request) const {
  const std::string name = name_in(request);
  try {
    const std::optional<std::string> file = find(name);
    if (!file) return no_such("file in the folder");
    Response response;
    response.set(http::field::content_type, "application/octet-stream");
    response.body() = gallery_scene(folder_ / *file);
    return guarded(std::move(response));
  } catch (...) {
    return guarded(plain(http::status::not_found, to_text(handled_error(name, "close other programs"))));
  }
}

Response GalleryAnswers::open(const std::string& name, std::uint16_t port) {
  const std::optional<std::string> file = find(name);
  if (!file) return no_such("file in the folder");
  ViewerOptions options = options_;
  options.port = port;
  opened_.open({.folder = folder_, .name = *file, .gallery = options});
  return opened();
}

Response GalleryAnswers::close() {
  opened_.close();
  return opened();
}

Response GalleryAnswers::opened() const {
  const std::optional<OpenedItem::State> state = opened_.state();
  if (!state) return json_answer(nullptr);
  const std::optional<OpenedItem::Page>& page = state->page;
  return json_answer({{"name", state->name},
                      {"said", state->said},
                      {"page", page ? json{{"port", page->port}, {"token", page->token}} : json()},
                      {"ended", state->has_ended}});
}

}  // namespace palpate
