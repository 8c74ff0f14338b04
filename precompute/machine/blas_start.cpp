#include "precompute/machine/blas_start.h"

#include <cblas.h>
#include <unistd.h>

#include <algorithm>
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
  std::vector<std::string> ours;
  ours.reserve(settings.size());
  for (const auto& [name, value] : settings) ours.push_back(std::string(name) + '=' + value);
  std::vector<char*> environment;
  environment.reserve(ours.size());
  for (std::string& setting : ours) environment.push_back(setting.data());
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view of_caller = *entry;
    const auto is_set = [&](const auto& setting) {
      return of_caller.substr(0, of_caller.find('=')) == setting.first;
    };
    if (std::none_of(settings.begin(), settings.end(), is_set)) environment.push_back(*entry);
  }
  environment.push_back(nullptr);
  ::execve(program.c_str(), argv, environment.data());
}

}  // namespace palpate
