#include "runtime/viewer/page_archive.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <new>

#include "runtime/serving/http_guard.h"

namespace palpate {
namespace {

void append_u32(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((value >> shift) & 0xFFU);
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string packed(size, '\0');
  const int result =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uLong>(bytes.size()), Z_DEFAULT_COMPRESSION);
  if (result != Z_OK) throw std::bad_alloc();  // with this capacity it cannot fail otherwise
  packed.resize(size);
  return packed;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t there = std::min<std::size_t>(bytes.size() - k, 3);
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 3; ++i)
      three = three << 8U | (i < there ? static_cast<unsigned char>(bytes[k + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i)
      text += i <= there ? digits[three >> (18U - 6U * static_cast<unsigned>(i)) & 63U] : '=';
  }
  return text;
}

}  // namespace

void PageArchive::add(std::string_view payload, unsigned kind) {
  append_u32(messages_, static_cast<std::uint32_t>(payload.size()));
  append_u32(messages_, kind);
  messages_ += payload;
}

std::string PageArchive::page(std::string_view page) const {
  const std::string data = "<script type=\"application/octet-stream\" id=\"palpate-session\">" +
                           base64(deflated(messages_)) + "</script>\n";
  std::string whole(page);
  constexpr std::string_view head = "<head>";
  if (const std::size_t at = whole.find(head); at != std::string::npos) {
    whole.insert(at + head.size(), "\n<meta name=\"generator\" content=\"palpate-runtime " PALPATE_VERSION
                                   "\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"" +
                                       page_policy() + "\">");
  }
  const std::size_t end = whole.rfind("</body>");
  whole.insert(end == std::string::npos ? whole.size() : end, data);
  return whole;
}

}  // namespace palpate
