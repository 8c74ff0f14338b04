#include "base/private_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <span>
#include <system_error>

#include "base/error.h"
#include "base/file_io.h"
#include "base/write_file.h"

namespace palpate {
namespace {

constexpr mode_t of_others = S_IWGRP | S_IWOTH;
constexpr const char* own_folder =
    "take a folder that is yours alone (mode 0700), and let XDG_RUNTIME_DIR name it";

[[noreturn]] void refuse_folder(const std::filesystem::path& folder, const std::string& why) {
  throw Error("the folder is not private: " + why, folder.string(), own_folder);
}

}  // namespace

std::filesystem::path private_file(const std::string& name) {
  struct Place {
    const char* variable;
    const char* below;
  };
  constexpr std::array<Place, 3> places = {
      {{"XDG_RUNTIME_DIR", ""}, {"XDG_STATE_HOME", ""}, {"HOME", ".local/state"}}};
  for (const Place& place : places) {
    const char* folder = std::getenv(place.variable);
    if (folder != nullptr && *folder == '/')
      return std::filesystem::path(folder) / place.below / "palpate" / name;
  }
  throw Error("there is no private folder of yours", name, own_folder);
}

void make_private_folder(const std::filesystem::path& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder.parent_path(), problem);
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST)
    refuse_folder(folder, std::system_category().message(errno));
  struct stat found {};
  if (lstat(folder.c_str(), &found) != 0) refuse_folder(folder, std::system_category().message(errno));
  if (!S_ISDIR(found.st_mode) || found.st_uid != geteuid() || (found.st_mode & of_others) != 0)
    refuse_folder(folder, "somebody else may write there");
}

void write_private_file(const std::filesystem::path& file, std::string_view text) {
  make_private_folder(file.parent_path());
  replace_file(file, text, S_IRUSR | S_IWUSR);
}

std::string read_private_file(const std::filesystem::path& file) {
  const FileDescriptor opened(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK), file);
  struct stat found {};
  if (opened.get() < 0 || fstat(opened.get(), &found) != 0) return {};
  if (!S_ISREG(found.st_mode) || found.st_uid != geteuid() || (found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return {};
  std::string text(static_cast<std::size_t>(found.st_size), '\0');
  text.resize(read_some(opened, std::as_writable_bytes(std::span(text)), 0));
  return text;
}

}  // namespace palpate
