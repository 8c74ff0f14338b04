#include "precompute/machine/allotment.h"

#include <sched.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <thread>

#include "base/limits/address_space.h"
#include "base/memory.h"

namespace palpate {
namespace {

/// First words of a file; none if it cannot be read.
std::vector<std::string> words_of(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// A nonnegative number; nullopt for "max" and -1, which set no limit.
std::optional<double> number(const std::vector<std::string>& words, std::size_t at) {
  if (at >= words.size()) return {};
  double value = 0.0;
  const std::string& word = words[at];
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || value < 0.0) return {};
  return value;
}

/// Calls visit(folder, is_v2) for each control group of a controller that contains this process, from the
/// innermost to the root: the limits of all of them apply.
void for_each_group(const std::string& root, const std::string& controller,
                    const std::function<void(const std::string&, bool)>& visit) {
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t name = line.find(':'), path = line.find(':', name + 1);
    if (name == std::string::npos || path == std::string::npos) continue;
    const std::string names = ',' + line.substr(name + 1, path - name - 1) + ',';
    const bool is_v2 = names == ",,";
    if (!is_v2 && names.find(',' + controller + ',') == std::string::npos) continue;
    const std::string mount = root + "/sys/fs/cgroup" + (is_v2 ? "" : '/' + controller);
    for (std::string group = line.substr(path + 1); !group.empty(); group.resize(group.rfind('/'))) {
      if (group != "/") visit(mount + group, is_v2);
      if (group.rfind('/') == std::string::npos) break;
    }
    visit(mount, is_v2);
  }
}

int processors_of_affinity() {
  // A mask of this size is too small if there are more processors.
  for (int processors = 1024; processors <= (1 << 20); processors *= 2) {
    cpu_set_t* const mask = CPU_ALLOC(static_cast<std::size_t>(processors));
    if (mask == nullptr) break;
    const std::size_t bytes = CPU_ALLOC_SIZE(static_cast<std::size_t>(processors));
    const int count = ::sched_getaffinity(0, bytes, mask) == 0 ? CPU_COUNT_S(bytes, mask) : 0;
    CPU_FREE(mask);
    if (count > 0) return count;
  }
  return static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

int allotted_processors(const std::string& root) {
  double processors = std::max(1, processors_of_affinity());
  for_each_group(root, "cpu", [&](const std::string& group, bool is_v2) {
    const std::vector<std::string> v2 = words_of(group + "/cpu.max");
    const auto quota = is_v2 ? number(v2, 0) : number(words_of(group + "/cpu.cfs_quota_us"), 0);
    const auto period = is_v2 ? number(v2, 1) : number(words_of(group + "/cpu.cfs_period_us"), 0);
    if (quota && period && *period > 0.0) processors = std::min(processors, std::ceil(*quota / *period));
  });
  if (const char* const slurm = std::getenv("SLURM_CPUS_PER_TASK"))
    if (const auto given = number({slurm}, 0)) processors = std::min(processors, *given);
  return std::max(1, static_cast<int>(processors));
}

std::int64_t allotted_memory(const std::string& root) {
  auto memory = static_cast<double>(available_memory());
  for_each_group(root, "memory", [&](const std::string& group, bool is_v2) {
    const auto limit = number(words_of(group + (is_v2 ? "/memory.max" : "/memory.limit_in_bytes")), 0);
    const auto used = number(words_of(group + (is_v2 ? "/memory.current" : "/memory.usage_in_bytes")), 0);
    if (!limit || !used || *limit > 1e18) return;  // v1 expresses "none" by a huge number
    const std::string cache = is_v2 ? "" : "total_";
    double free = *limit - *used;
    const std::vector<std::string> stat = words_of(group + "/memory.stat");
    for (std::size_t k = 0; k + 1 < stat.size(); k += 2)
      if (stat[k] == cache + "inactive_file" || stat[k] == cache + "active_file")
        free += number(stat, k + 1).value_or(0.0);
    memory = std::min(memory, std::max(free, 1.0));
  });
  // Slurm's allocation, in case Slurm does not enforce it by control groups [MB].
  const auto of_slurm = [](const char* name) {
    const char* const text = std::getenv(name);
    return text == nullptr ? std::nullopt : number({text}, 0);
  };
  constexpr double megabyte = 1 << 20;
  if (const auto given = of_slurm("SLURM_MEM_PER_NODE"); given && *given > 0.0)
    memory = std::min(memory, *given * megabyte);
  const auto each = of_slurm("SLURM_MEM_PER_CPU"), processors = of_slurm("SLURM_CPUS_ON_NODE");
  if (each && processors && *each > 0.0) memory = std::min(memory, *each * *processors * megabyte);
  if (const auto left = address_room()) memory = std::min(memory, std::max(static_cast<double>(*left), 1.0));
  return static_cast<std::int64_t>(memory);
}

}  // namespace palpate
