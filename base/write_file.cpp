#include "base/write_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"

namespace palpate {
namespace {

std::string hint_to_write(int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "make its folder first, or write elsewhere";
    case EACCES:
    case EPERM:
    case EROFS:
      return "check the rights of the file and of its folder, or write elsewhere";
    case EPIPE:
    case ENXIO:
      return "start the program that reads from it first";
    default:
      return "check the folder, its rights and the free space";
  }
}

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
  throw Error("cannot be written: " + std::generic_category().message(error), file.string(),
              hint_to_write(error));
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw Error(what, file.string(), "give the name of a file");
}

/// While it lives, writing to a pipe without a reader is an error and does not end the program.
class IgnoredPipeSignal {
 public:
  IgnoredPipeSignal() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &before_);
  }
  ~IgnoredPipeSignal() { sigaction(SIGPIPE, &before_, nullptr); }
  IgnoredPipeSignal(const IgnoredPipeSignal&) = delete;
  IgnoredPipeSignal& operator=(const IgnoredPipeSignal&) = delete;

 private:
  struct sigaction before_ {};
};

std::optional<struct stat> status_of(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0) return status;
  if (errno != ENOENT && errno != ENOTDIR) fail(file, errno);
  return std::nullopt;
}

/// Descriptor of the standard stream that goes to the file with this status; -1 if none does.
int standard_stream(const struct stat& status) {
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat open {};
    if (::fstat(fd, &open) == 0 && open.st_dev == status.st_dev && open.st_ino == status.st_ino) return fd;
  }
  return -1;
}

}  // namespace

std::filesystem::path link_target(const std::filesystem::path& file) {
  std::error_code failed;
  if (!std::filesystem::is_symlink(file, failed)) return file;
  std::filesystem::path target = std::filesystem::canonical(file, failed);
  if (failed)
    throw Error("is a symbolic link to nothing", file.string(), "remove the link, or write elsewhere");
  return target;
}

WriteTarget write_target(const std::filesystem::path& file) {
  const std::optional<struct stat> status = status_of(file);
  if (!status) {
    (void)link_target(file);
    return WriteTarget::regular;
  }
  if (S_ISDIR(status->st_mode)) refuse(file, "is a folder");
  if (S_ISSOCK(status->st_mode) && standard_stream(*status) < 0) refuse(file, "is a socket");
  if (S_ISBLK(status->st_mode)) refuse(file, "is a block device");
  if (standard_stream(*status) >= 0) return WriteTarget::standard_stream;
  return S_ISREG(status->st_mode) ? WriteTarget::regular : WriteTarget::stream;
}

int open_stream(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd < 0 && errno == ENXIO)
    throw Error("is a pipe that no program reads", file.string(), hint_to_write(ENXIO));
  if (fd < 0) fail(file, errno);
  ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  return fd;
}

TemporaryFile::TemporaryFile(std::filesystem::path target, mode_t mode) : target_(std::move(target)) {
  constexpr int most = 1000;
  for (int k = 1; fd_ < 0; ++k) {
    path_ = target_.string() + ".partial" + (k > 1 ? std::to_string(k) : "");
    fd_ = make_new_file(path_, mode);
    if (fd_ < 0 && (errno != EEXIST || k == most)) fail(target_, errno);
  }
}

TemporaryFile::~TemporaryFile() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(path_.c_str());
}

void TemporaryFile::write(std::string_view bytes) {
  if (const int error = write_all(fd_, bytes)) fail(target_, error);
}

void TemporaryFile::take_its_place(bool keeps) {
  rename_durably(path_, target_, keeps);
  ::close(std::exchange(fd_, -1));
}

FileWriter::FileWriter(const std::filesystem::path& file) {
  const WriteTarget target = write_target(file);
  if (target == WriteTarget::regular) {
    temporary_.emplace(link_target(file));
    return;
  }
  std::fflush(stdout);  // text printed earlier
  const int fd = target == WriteTarget::stream ? open_stream(file) : ::dup(standard_stream(*status_of(file)));
  stream_ = FileDescriptor(fd, file);
}

void FileWriter::write(std::string_view bytes) {
  bytes_ += bytes.size();
  if (temporary_) {
    temporary_->write(bytes);
    return;
  }
  const IgnoredPipeSignal ignored;
  if (const int error = write_all(stream_.get(), bytes)) fail(stream_.path(), error);
}

void FileWriter::finish() {
  if (temporary_) temporary_->take_its_place();
}

void write_file(const std::filesystem::path& file, std::string_view bytes) {
  FileWriter writer(file);
  writer.write(bytes);
  writer.finish();
}

void write_new_file(const std::filesystem::path& file, std::string_view bytes) {
  TemporaryFile temporary(file);
  temporary.write(bytes);
  temporary.take_its_place(true);
}

void replace_file(const std::filesystem::path& file, std::string_view bytes, mode_t mode) {
  TemporaryFile temporary(file, mode);
  temporary.write(bytes);
  temporary.take_its_place();
}

void expect_writable_folder(const std::filesystem::path& file) {
  const TemporaryFile made_and_removed(link_target(file));
}

}  // namespace palpate
