// Paths that a run may write to.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/file_io.h"
#include "formats/output_kind.h"

namespace palpate {

/// Throws Error if the name's ending is a word that is not one of the kind's (`endings_of`), since other
/// programs go by it. A name without ending is always accepted. `what`: "the report (--report)".
void expect_ending(const std::filesystem::path& file, OutputKind kind, const std::string& what);

/// Checks the paths that a run writes to before its work begins. An output never replaces a file that the run
/// reads, or another of its outputs, under whatever name (links). It replaces an existing file only if that
/// is empty or an earlier output of the same kind (but no recording with ticks), or if forced. Lives as long
/// as the run: it holds pipes open, so that their readers wait.
class OutputPaths {
 public:
  /// `force`: true if --force was given, which allows existing files of any kind to be replaced, unless the
  /// run reads them; nullopt if there is no such option. `keep`: no file is replaced.
  explicit OutputPaths(std::optional<bool> force = {}, bool keep = false) : force_(force), keep_(keep) {}

  /// Adds a file or folder that the run reads; `what` names it, "the script". Files that do not exist are
  /// ignored. Throws Error if an output would destroy it.
  void add_input(const std::filesystem::path& path, const std::string& what);

  /// Returns the path to write the output to: of a symbolic link to a file, that file. Throws Error, with the
  /// reason, if it may not or cannot be written, or has the ending of another format. `option` is the option
  /// that requests it, "--record".
  std::filesystem::path add(const std::filesystem::path& path, OutputKind kind, const std::string& option);

 private:
  struct Known {
    std::filesystem::path path;  // without links
    std::optional<struct stat> status;
    std::string what;
  };

  static Known known(const std::filesystem::path& path, const std::string& what);
  void refuse_inputs(const Known& output) const;
  void refuse_outputs(const Known& output) const;
  void add_beside(const std::filesystem::path& path, const std::string& what);

  std::optional<bool> force_;
  bool keep_;
  std::vector<Known> inputs_;
  std::vector<Known> outputs_;
  std::vector<FileDescriptor> pipes_;
};

}  // namespace palpate
