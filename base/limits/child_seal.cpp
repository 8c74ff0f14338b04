#include "base/limits/child_seal.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/limits/descriptors.h"

namespace palpate {
namespace {

#if defined(__x86_64__)
constexpr std::uint32_t machine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t machine = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t machine = 0;  // not known to us: no seal
#endif

/// System calls of code that only computes, allowed with any arguments. The C library and the sanitizers
/// choose between equivalent calls, and differ between versions.
constexpr auto allowed = std::to_array<std::uint32_t>({
    __NR_read,
    __NR_readv,
    __NR_pread64,
    __NR_write,
    __NR_writev,
    __NR_lseek,
    __NR_close,
    __NR_fstat,
    __NR_dup,
    __NR_mmap,
    __NR_munmap,
    __NR_mremap,
    __NR_mprotect,
    __NR_madvise,
    __NR_brk,
    __NR_mincore,
    __NR_rt_sigaction,
    __NR_rt_sigprocmask,
    __NR_rt_sigreturn,
    __NR_sigaltstack,
    __NR_restart_syscall,
    __NR_exit,
    __NR_exit_group,
    __NR_getpid,
    __NR_gettid,
    __NR_getuid,
    __NR_geteuid,
    __NR_getgid,
    __NR_getegid,
    __NR_clock_gettime,
    __NR_clock_getres,
    __NR_clock_nanosleep,
    __NR_nanosleep,
    __NR_gettimeofday,
    __NR_times,
    __NR_getrusage,
    __NR_getrandom,
    __NR_futex,
    __NR_sched_yield,
    __NR_sched_getaffinity,
    __NR_getcpu,
    __NR_membarrier,
    __NR_uname,
    __NR_sysinfo,
    __NR_ppoll,
#ifdef __SANITIZE_ADDRESS__
    __NR_pipe2,  // by which UBSan finds out whether memory can be read
#ifdef __NR_pipe
    __NR_pipe,
#endif
#endif
#ifdef __NR_time
    __NR_time,
#endif
#ifdef __NR_poll
    __NR_poll,
    __NR_pause,
#endif
});

/// A system call that is allowed if an argument has this value.
struct Allowance {
  std::uint32_t call;
  std::uint32_t argument;
  std::uint32_t value;
};

constexpr sock_filter statement(std::uint16_t code, std::uint32_t value) {
  return {code, 0, 0, value};
}

constexpr sock_filter load(std::size_t offset) {
  return statement(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
}

/// Continues if the loaded word is `value`, else skips `skipped` steps.
constexpr sock_filter only_if(std::uint32_t value, std::uint8_t skipped) {
  return {BPF_JMP | BPF_JEQ | BPF_K, 0, skipped, value};
}

constexpr sock_filter allow = statement(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
constexpr sock_filter refuse = statement(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM);

void close_all_but(std::span<const int> kept) {
  int first = STDERR_FILENO + 1;
  for (;;) {
    int next = -1;  // smallest kept descriptor from `first` on
    for (const int fd : kept)
      if (fd >= first && (next < 0 || fd < next)) next = fd;
    if (next < 0) break;
    close_descriptors(first, next - 1);
    first = next + 1;
  }
  close_descriptors(first, std::numeric_limits<int>::max());
}

}  // namespace

bool can_seal() noexcept {
  return machine != 0 && ::prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0;
}

bool seal_process(std::span<const int> kept) noexcept {
  close_all_but(kept);
  const auto self = static_cast<std::uint32_t>(::getpid());
  const std::array<Allowance, 7> limited = {{{__NR_tgkill, 0, self},  // abort() and raise()
                                             {__NR_kill, 0, self},
                                             {__NR_fcntl, 1, F_GETFD},
                                             {__NR_fcntl, 1, F_SETFD},
                                             {__NR_fcntl, 1, F_GETFL},
                                             {__NR_fcntl, 1, F_DUPFD},
                                             {__NR_fcntl, 1, F_DUPFD_CLOEXEC}}};
  std::array<sock_filter, 4 + 2 * allowed.size() + 5 * limited.size() + 1> program{};
  std::size_t size = 0;
  const auto add = [&](sock_filter step) { program.at(size++) = step; };
  add(load(offsetof(seccomp_data, arch)));
  add({BPF_JMP | BPF_JEQ | BPF_K, 1, 0, machine});
  add(refuse);  // a call by another machine's table
  add(load(offsetof(seccomp_data, nr)));
  for (const std::uint32_t call : allowed) {
    add(only_if(call, 1));
    add(allow);
  }
  for (const Allowance& limit : limited) {
    add(load(offsetof(seccomp_data, nr)));
    add(only_if(limit.call, 3));
    add(load(offsetof(seccomp_data, args) + limit.argument * sizeof(std::uint64_t)));  // its lower half
    add(only_if(limit.value, 1));
    add(allow);
  }
  add(refuse);
  const sock_fprog filter{static_cast<unsigned short>(size), program.data()};
  return can_seal() && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) == 0;
}

}  // namespace palpate
