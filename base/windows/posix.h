// Functions of POSIX that libpalpate calls and MinGW lacks, as far as files are read. On Windows included
// before all else.
#pragma once
#pragma GCC system_header  // functions named as structs, as POSIX has them

#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#include <unistd.h>

#ifdef __cplusplus

#include <cerrno>
#include <csignal>
#include <cstddef>

constexpr int O_CLOEXEC = _O_NOINHERIT, O_NONBLOCK = 0, O_NOCTTY = 0, O_NOFOLLOW = 0, O_DIRECTORY = 0;
constexpr int PROT_READ = 1, MAP_PRIVATE = 2, MADV_WILLNEED = 3;
inline void* const MAP_FAILED = reinterpret_cast<void*>(-1);
constexpr int LOCK_SH = 1, LOCK_EX = 2, LOCK_NB = 4, LOCK_UN = 8;
constexpr int AT_FDCWD = -100, RENAME_NOREPLACE = 1, F_GETFL = 3, F_SETFL = 4, SIGPIPE = 13,
              _SC_PAGESIZE = 30;
constexpr int EDQUOT = 10069;

// Of more bytes than MinGW counts a part is read or written, as POSIX may.
inline unsigned at_most(std::size_t bytes) noexcept {
  return static_cast<unsigned>(bytes < (1U << 30U) ? bytes : (1U << 30U));
}
inline ssize_t read(int file, void* into, std::size_t bytes) noexcept {
  return ::read(file, into, at_most(bytes));
}
inline ssize_t write(int file, const void* from, std::size_t bytes) noexcept {
  return ::write(file, from, at_most(bytes));
}
ssize_t pread(int file, void* into, std::size_t bytes, off_t offset) noexcept;
void* mmap(void* at, std::size_t bytes, int protection, int flags, int file, off_t offset) noexcept;
int munmap(void* at, std::size_t bytes) noexcept;
long sysconf(int name) noexcept;  // _SC_PAGESIZE: to what offsets of mappings are rounded
inline int madvise(void*, std::size_t, int) noexcept {
  return 0;
}

// With the names of std::filesystem::path, which are wide; files are read as they are.
inline int open(const wchar_t* path, int flags, int mode = 0) noexcept {
  return ::_wopen(path, flags | _O_BINARY, mode);
}
inline int stat(const wchar_t* path, struct stat* status) noexcept {
  return ::_wstat64(path, status);
}
inline int lstat(const wchar_t* path, struct stat* status) noexcept {
  return ::_wstat64(path, status);
}
inline int access(const wchar_t* path, int mode) noexcept {
  return ::_waccess(path, mode);
}
inline int unlink(const wchar_t* path) noexcept {
  return ::_wunlink(path);
}
inline bool S_ISSOCK(int) noexcept {
  return false;
}
constexpr int S_IFSOCK = 0xC000;

// What writes outputs links, and fails: nothing is written on Windows yet.
inline int not_there() noexcept {
  errno = ENOSYS;
  return -1;
}
struct statvfs {
  unsigned long f_bavail, f_frsize;
};
#define st_blocks st_size / 512
inline int statvfs(const wchar_t*, struct statvfs*) noexcept {
  return not_there();
}
inline int fallocate(int, int, off_t, off_t) noexcept {
  return not_there();
}
inline ssize_t pwrite(int, const void*, std::size_t, off_t) noexcept {
  return not_there();
}
inline int flock(int, int) noexcept {
  return 0;
}
inline int fsync(int) noexcept {
  return not_there();
}
inline int fcntl(int, int, int = 0) noexcept {
  return not_there();
}
inline int link(const wchar_t*, const wchar_t*) noexcept {
  return not_there();
}
inline int renameat2(int, const wchar_t*, int, const wchar_t*, unsigned) noexcept {
  return not_there();
}
struct sigaction {
  void (*sa_handler)(int);
};
inline int sigaction(int, const struct sigaction*, struct sigaction*) noexcept {
  return not_there();
}

#endif
