#include "runtime/library/c_error.h"

#include <algorithm>
#include <array>

namespace palpate {
namespace {

constexpr std::array<const char*, 7> code_names = {"ok",    "argument",   "file",    "memory",
                                                   "state", "incomplete", "internal"};

thread_local int last_code = PALPATE_OK;

}  // namespace

void copy_text(std::string_view text, char* to, std::size_t size) noexcept {
  if (to == nullptr || size == 0) return;
  const std::size_t length = std::min(text.size(), size - 1);
  std::copy_n(text.data(), length, to);
  to[length] = '\0';
}

void set_last_code(int code) noexcept {
  last_code = code;
}

}  // namespace palpate

extern "C" {

const char* palpate_code_name(int code) noexcept {
  using palpate::code_names;
  return code >= 0 && code < std::ssize(code_names) ? code_names.at(static_cast<std::size_t>(code)) : nullptr;
}

int palpate_last_code() noexcept {
  return palpate::last_code;
}

}  // extern "C"
