#include "runtime/real_time.h"

#include <fmt/core.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>

namespace palpate {
namespace {

constexpr int priority = 80;  // above audio servers, below the kernel's own threads

bool set_policy(int policy, int value) {
  sched_param param{};
  param.sched_priority = value;
  return sched_setscheduler(0, policy, &param) == 0;
}

}  // namespace

RealTimeRights::RealTimeRights() {
  scheduled_ = set_policy(SCHED_FIFO, priority);
  if (!scheduled_) refused_ = fmt::format("SCHED_FIFO ({})", std::strerror(errno));
  locked_ = mlockall(MCL_CURRENT) == 0;
  if (!locked_)
    refused_ += fmt::format("{}locked memory ({})", scheduled_ ? "" : " and ", std::strerror(errno));
  if (!refused_.empty()) {
    refused_ = "ticks may be late: the system refused " + refused_ +
               "; allow rtprio and memlock in /etc/security/limits.conf, or setcap "
               "cap_sys_nice,cap_ipc_lock+ep palpate-runtime";
  }
}

RealTimeRights::~RealTimeRights() {
  if (scheduled_) set_policy(SCHED_OTHER, 0);
  if (locked_) munlockall();
}

}  // namespace palpate
