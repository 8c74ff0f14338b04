#include "precompute/machine/blas_start.h"

#include <cblas.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/limits/address_space.h"
#include "precompute/machine/blas_kernels.h"

namespace palpate {
namespace {

constexpr const char* blas_threads = "OPENBLAS_NUM_THREADS";

bool has_threads_of_its_own() {
  const char* const threads = std::getenv(blas_threads);
  return threads == nullptr || std::string_view(threads) != "1";
}

}  // namespace

void start_blas(char** argv) {
  std::vector<std::pair<const char*, std::string>> settings;
  if (const std::string kernels = kernels_to_ask_for(); !kernels.empty())
    settings = {{asked_kernels, kernels}, {kernels_before, openblas_get_corename()}};
  if (address_room() && has_threads_of_its_own()) {
    settings.emplace_back(blas_threads, "1");
    settings.emplace_back("OMP_NUM_THREADS", "1");
  }
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (settings.empty() || unknown) return;
  for (const auto& [name, value] : settings) ::setenv(name, value.c_str(), 1);
  ::execv(program.c_str(), argv);
  for (const auto& [name, value] : settings) ::unsetenv(name);
}

}  // namespace palpate
