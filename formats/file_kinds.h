// What files of bodies are, by what they begin with and by their names: those that are read, and their common
// neighbours, with the command that makes one that is read of them.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// A kind of file.
struct FileKind {
  std::string_view what;  ///< "a NIfTI image"
  std::string_view
      endings;  ///< of names, in small letters, each with a blank behind; the first is the usual one
  std::string_view geometry;  ///< the key of [geometry] that reads it; empty: none does
  std::string_view command;   ///< not read: what helps; FILE and NAME, without ending, stand for the file's
};

/// By the file's name, whatever the case of its letters; null for an unknown one.
const FileKind* kind_by_name(const std::filesystem::path& file);

/// By what the file begins with; null where that says nothing, and for what is no file.
const FileKind* kind_by_content(const std::filesystem::path& file);

/// The file's name without folder and ending: "organ" of "in/organ.inr.gz".
std::string name_without_ending(const std::filesystem::path& file);

/// Throws Error for a file that is of a kind that is not read, by its content or, where that says nothing, by
/// its name; for one whose content is of another kind than its name says; and where `geometry`, a key of
/// [geometry], is given and does not read it. Says nothing of unknown files.
void check_is_read(const std::filesystem::path& file, std::string_view geometry = {});

}  // namespace palpate
