// Error reporting of the C functions.
#pragma once

#include <cstddef>
#include <filesystem>
#include <new>
#include <string_view>

#include "base/error.h"
#include "runtime/library/palpate.h"

namespace palpate {

/// Copies text, cut to `size` bytes including the terminating zero.
void copy_text(std::string_view text, char* to, std::size_t size) noexcept;

/// Sets the result of this thread's last call that takes `error`.
void set_last_code(int code) noexcept;

/// Why a session or recording could not be entered: there is none, or not now.
inline int refused(const void* handle) noexcept {
  return handle == nullptr ? -1 : PALPATE_ERROR_STATE;
}

/// Runs `work(code)`, which may set `code` to that of failures from then on; it begins as
/// PALPATE_ERROR_ARGUMENT. Returns PALPATE_OK, or the code with the reason in `error`. `place` is the
/// function and `if_no_memory` a hint, as in handled_error.
template <typename Work>
int tell_failure(const char* place, const char* if_no_memory, char* error, std::size_t error_size,
                 Work&& work) noexcept {
  copy_text("", error, error_size);
  int code = PALPATE_ERROR_ARGUMENT;
  try {
    work(code);
    code = PALPATE_OK;
  } catch (...) {
    try {
      throw;
    } catch (const std::bad_alloc&) {
      code = PALPATE_ERROR_MEMORY;
    } catch (const Error&) {  // code set by `work`
    } catch (const std::filesystem::filesystem_error&) {
      code = PALPATE_ERROR_FILE;
    } catch (...) {
      code = PALPATE_ERROR_INTERNAL;
    }
    try {
      copy_text(to_text(handled_error(place, if_no_memory)), error, error_size);
    } catch (...) {  // no memory even for that
    }
  }
  set_last_code(code);
  return code;
}

}  // namespace palpate
