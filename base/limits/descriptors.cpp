#include "base/limits/descriptors.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>

namespace palpate {

void close_descriptors(int first, int last) noexcept {
  if (first > last) return;
#ifdef __NR_close_range  // the C library has it from 2.34 on
  if (::syscall(__NR_close_range, first, last, 0) == 0) return;
#endif
  rlimit limit{};
  constexpr rlim_t most = 1 << 16;  // on kernels before 5.9
  ::getrlimit(RLIMIT_NOFILE, &limit);
  for (int fd = first; fd <= last && static_cast<rlim_t>(fd) < std::min(limit.rlim_cur, most); ++fd)
    ::close(fd);
}

}  // namespace palpate
