#include "runtime/loop/real_time.h"

#include <fmt/core.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "base/error.h"

namespace palpate {
namespace {

bool set_policy(int policy, int value) noexcept {
  sched_param param{};
  param.sched_priority = value;
  return sched_setscheduler(0, policy, &param) == 0;
}

}  // namespace

bool ask_for_priority(int priority) noexcept {
  return set_policy(SCHED_FIFO, priority);
}

RealTimeRights::RealTimeRights(std::optional<int> processor) {
  std::vector<std::string> without;
  const auto refuse = [&](const std::string& what) {
    without.push_back(fmt::format("{} ({})", what, std::strerror(errno)));
  };
  scheduled_ = ask_for_priority(loop_priority);
  if (!scheduled_) refuse("SCHED_FIFO");
  locked_ = mlockall(MCL_CURRENT) == 0;
  if (!locked_) refuse("locked memory");
  if (processor) {
    cpu_set_t only;
    CPU_ZERO(&only);
    CPU_SET(static_cast<std::size_t>(*processor), &only);
    if (sched_setaffinity(0, sizeof only, &only) != 0) refuse(fmt::format("processor {}", *processor));
  }
  if (without.empty()) return;
  for (const std::string& what : without) refused_ += (refused_.empty() ? "" : " and ") + what;
  refused_ = "ticks may be late: the system refused " + refused_ +
             "; allow rtprio 80 and memlock unlimited in /etc/security/limits.conf, or setcap "
             "cap_sys_nice,cap_ipc_lock+ep palpate-runtime";
}

RealTimeRights::~RealTimeRights() {
  if (scheduled_) set_policy(SCHED_OTHER, 0);
  if (locked_) munlockall();
}

void leave_to_the_loop(int processor) {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  const bool known = sched_getaffinity(0, sizeof mask, &mask) == 0;
  const auto place = static_cast<std::size_t>(processor);
  if (!known || processor < 0 || processor >= CPU_SETSIZE || !CPU_ISSET(place, &mask)) {
    throw Error(fmt::format("this process may not use processor {}", processor), "--cpu",
                "see /sys/devices/system/cpu/online and taskset -p $$");
  }
  CPU_CLR(place, &mask);
  if (CPU_COUNT(&mask) > 0) sched_setaffinity(0, sizeof mask, &mask);
}

}  // namespace palpate
