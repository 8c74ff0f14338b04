// Processors and memory within the limits of control groups and of Slurm.
#include "precompute/machine/allotment.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "base/limits/address_space.h"

namespace palpate::allotment_test {
namespace {

/// A /proc and a /sys of their own, and no Slurm around them.
class Allotment : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : names) {
      if (const char* const slurm = std::getenv(name)) before_[name] = slurm;
      ::unsetenv(name);
    }
  }
  void TearDown() override {
    for (const char* name : names) ::unsetenv(name);
    for (const auto& [name, value] : before_) ::setenv(name.c_str(), value.c_str(), 1);
    std::filesystem::remove_all(root_);
  }
  void put(const std::string& file, const std::string& text) const {
    const std::filesystem::path path = root_.string() + file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  [[nodiscard]] int processors() const { return allotted_processors(root_.string()); }
  [[nodiscard]] std::int64_t memory() const { return allotted_memory(root_.string()); }

  std::filesystem::path root_ =
      std::filesystem::temp_directory_path() / ("palpate_allotment_" + std::to_string(::getpid()));
  static constexpr std::array names = {"SLURM_CPUS_PER_TASK", "SLURM_MEM_PER_NODE", "SLURM_MEM_PER_CPU",
                                       "SLURM_CPUS_ON_NODE"};
  std::map<std::string, std::string> before_;
};

TEST_F(Allotment, WithoutLimitsIsTheAffinity) {
  cpu_set_t mask;
  ASSERT_EQ(::sched_getaffinity(0, sizeof mask, &mask), 0);
  EXPECT_EQ(processors(), CPU_COUNT(&mask));
  EXPECT_GT(memory(), 0);
}

TEST_F(Allotment, AffinityOfOneProcessor) {
  std::thread([&] {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(::sched_getcpu()), &one);
    ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
    EXPECT_EQ(processors(), 1);
  }).join();
}

TEST_F(Allotment, QuotaOfAnyGroupAboveIsRoundedUp) {
  put("/proc/self/cgroup", "0::/batch/job_7/step_0\n");
  put("/sys/fs/cgroup/batch/job_7/step_0/cpu.max", "max 100000\n");
  put("/sys/fs/cgroup/batch/job_7/cpu.max", "50000 100000\n");
  put("/sys/fs/cgroup/cpu.max", "800000 100000\n");
  EXPECT_EQ(processors(), 1);
}

TEST_F(Allotment, QuotaOfTheFirstVersionOfGroups) {
  put("/proc/self/cgroup", "3:cpuset:/\n2:cpu,cpuacct:/job\n1:memory:/\n");
  put("/sys/fs/cgroup/cpu/job/cpu.cfs_quota_us", "99000\n");
  put("/sys/fs/cgroup/cpu/job/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(processors(), 1);
}

TEST_F(Allotment, SlurmsCpusOfATask) {
  ::setenv("SLURM_CPUS_PER_TASK", "1", 1);
  EXPECT_EQ(processors(), 1);
}

TEST_F(Allotment, SlurmsMemoryOfANodeOrOfItsCpus) {
  ::setenv("SLURM_MEM_PER_NODE", "3", 1);
  EXPECT_EQ(memory(), 3 << 20);
  ::setenv("SLURM_MEM_PER_NODE", "0", 1);  // all that there is
  EXPECT_GT(memory(), 3 << 20);
  ::setenv("SLURM_MEM_PER_CPU", "2", 1);
  ::setenv("SLURM_CPUS_ON_NODE", "4", 1);
  EXPECT_EQ(memory(), 8 << 20);
}

TEST_F(Allotment, MemoryOfAGroupCountsItsCacheAsFree) {
  put("/proc/self/cgroup", "0::/job\n");
  put("/sys/fs/cgroup/job/memory.max", "1000000\n");
  put("/sys/fs/cgroup/job/memory.current", "400000\n");
  put("/sys/fs/cgroup/job/memory.stat", "anon 100000\ninactive_file 200000\nactive_file 50000\n");
  EXPECT_EQ(memory(), 850'000);
  put("/sys/fs/cgroup/job/memory.max", "max\n");
  EXPECT_GT(memory(), 850'000);
}

TEST_F(Allotment, MemoryOfTheFirstVersionOfGroups) {
  put("/proc/self/cgroup", "4:memory:/a/b\n");
  put("/sys/fs/cgroup/memory/a/memory.limit_in_bytes", "700000\n");
  put("/sys/fs/cgroup/memory/a/memory.usage_in_bytes", "600000\n");
  put("/sys/fs/cgroup/memory/a/memory.stat", "inactive_file 7\ntotal_inactive_file 30000\n");
  put("/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  put("/sys/fs/cgroup/memory/memory.usage_in_bytes", "1\n");
  EXPECT_EQ(memory(), 130'000);
}

TEST_F(Allotment, AddressSpaceIsALimit) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take all address space";
#endif
  constexpr std::int64_t left = 300'000'000;
  const pid_t child = ::fork();
  if (child == 0) {
    const auto whole = static_cast<rlim_t>(address_space() + left);
    const rlimit limit{whole, whole};
    ::setrlimit(RLIMIT_AS, &limit);
    const std::int64_t seen = memory();
    ::_exit(seen > left / 2 && seen <= left ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace palpate::allotment_test
