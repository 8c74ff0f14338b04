// Kinds of files, recognised by their first bytes and by their names: those that are read, and common other
// ones with the command that converts them.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// A kind of file.
struct FileKind {
  std::string_view what;  ///< in words: "a NIfTI image"
  std::string_view
      endings;  ///< of names, in small letters, each followed by a blank; the first is the usual one
  std::string_view geometry;  ///< key of [geometry] that reads it; empty if none does
  std::string_view command;   ///< if not read: command that helps; FILE and NAME (without ending) stand for
                              ///< the file
};

/// Kind by the file's name, in capital or small letters; null for an unknown one.
const FileKind* kind_by_name(const std::filesystem::path& file);

/// Kind by the file's first bytes; null if they are inconclusive or there is no file.
const FileKind* kind_by_content(const std::filesystem::path& file);

/// Name of a file without folder and ending: "organ" of "in/organ.inr.gz".
std::string name_without_ending(const std::filesystem::path& file);

/// Throws Error for a file of a kind that is not read, by its content or, if that is inconclusive, by its
/// name; for content of another kind than the name; and if `geometry`, a key of [geometry], is given and does
/// not read it. Accepts unknown files.
void check_is_read(const std::filesystem::path& file, std::string_view geometry = {});

}  // namespace palpate
