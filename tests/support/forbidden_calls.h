// What a sealed process may not do, tried.
#pragma once

#include <fcntl.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string>

namespace palpate::test {

/// Names of those calls that did not fail with EPERM; nothing where all did. `other` is another process of
/// the same user. Where nothing is refused this becomes /bin/true.
inline std::string calls_that_are_not_refused(pid_t other) {
  std::string names;
  const auto refused = [&](const char* name, long result) {
    if (result != -1 || errno != EPERM) names += std::string(names.empty() ? "" : ", ") + name;
    return result == -1;
  };
  char program[] = "/bin/true";
  char* arguments[] = {program, nullptr};
  refused("execve", ::execve(program, arguments, nullptr));
  const char* const passwords = "/etc/passwd";
  struct stat status {};
  refused("open", ::open(passwords, O_RDONLY));
  refused("openat", ::syscall(__NR_openat, AT_FDCWD, passwords, O_RDONLY, 0));
  refused("open of /proc", ::open("/proc/self/mem", O_RDWR));
  refused("making a file", ::open("/tmp/palpate_made_by_a_child", O_CREAT | O_WRONLY, 0600));
  refused("stat", ::stat(passwords, &status));
  refused("access", ::access(passwords, R_OK));
  refused("unlink", ::unlink("/tmp/palpate_that_is_not_there"));
  refused("mkdir", ::mkdir("/tmp/palpate_made_by_a_child", 0700));
  refused("chdir", ::chdir("/"));
  refused("memfd_create", ::syscall(__NR_memfd_create, "x", 0));
  for (const int family : {AF_INET, AF_INET6, AF_UNIX, AF_NETLINK})
    refused("socket", ::socket(family, SOCK_DGRAM, 0));
  int pair[2];
  refused("socketpair", ::socketpair(AF_UNIX, SOCK_STREAM, 0, pair));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(9);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  refused("connect", ::connect(0, reinterpret_cast<const sockaddr*>(&address), sizeof address));
  refused("sendto", ::sendto(0, "x", 1, 0, reinterpret_cast<const sockaddr*>(&address), sizeof address));
  refused("bind", ::bind(0, reinterpret_cast<const sockaddr*>(&address), sizeof address));
  const long child = ::syscall(__NR_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr);
  if (child == 0) ::_exit(0);
  refused("clone", child);
  refused("kill", ::kill(other, 0));
  refused("tgkill", ::syscall(__NR_tgkill, other, other, 0));
  refused("ptrace", ::ptrace(PTRACE_SEIZE, other, nullptr, nullptr));
  refused("prctl", ::syscall(__NR_prctl, 38 /* PR_SET_NO_NEW_PRIVS */, 1, 0, 0, 0));
  refused("io_uring_setup", ::syscall(__NR_io_uring_setup, 1, nullptr));
  refused("process_vm_readv", ::syscall(__NR_process_vm_readv, other, nullptr, 0, nullptr, 0, 0));
  return names;
}

}  // namespace palpate::test
