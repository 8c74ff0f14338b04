// Where a run may write.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/file_io.h"
#include "formats/output_kind.h"

namespace palpate {

/// Other programs go by the ending of a name: throws Error where it is a word and not one of the kind's, as
/// `endings_of` has them. A name without one may be anything. `what`: "the report (--report)".
void expect_ending(const std::filesystem::path& file, OutputKind kind, const std::string& what);

/// Decides which paths a run may write, before its work begins. An output never takes the place of what the
/// run reads, nor of another of its outputs, under whatever name (links). It takes the place of an existing
/// file only where that is empty or an earlier output of the same kind (no recording that holds ticks), or
/// where that is forced. Lives as
/// long as the run: it holds pipes open, so that their readers wait.
class OutputPaths {
 public:
  /// `force`: whether --force was given, with which existing files may be replaced whatever they are, unless
  /// the run reads them; nothing where there is no such option. `keep`: none is replaced.
  explicit OutputPaths(std::optional<bool> force = {}, bool keep = false) : force_(force), keep_(keep) {}

  /// A file or folder that the run reads, and what it is, "the script". One that is not there is nobody's
  /// loss. Throws Error where an output would destroy it.
  void add_input(const std::filesystem::path& path, const std::string& what);

  /// Returns where to write the output: of a symbolic link to a file, that file. Throws Error, with the
  /// reason, where it may not or cannot be written, or has another format's ending. `option` says what asks
  /// for it, "--record".
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
