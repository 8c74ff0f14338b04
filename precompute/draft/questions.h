// A description by questions and answers.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "precompute/draft/draft.h"

namespace palpate {

/// Who is asked.
struct Conversation {
  std::istream& answers;
  std::ostream& questions;
  bool is_terminal = false;  ///< there a wrong answer is asked for again; from a pipe it is an error
};

/// Asks for what a description of a surface or an image needs, each with a default that an empty line takes,
/// and writes it as `draft` does. `file` is asked for where it is empty. Returns the description's file.
/// Throws Error as `draft` does, for a wrong answer from a pipe, and where the answers end too early.
std::filesystem::path draft_by_questions(std::filesystem::path file, DraftOptions options,
                                         const Conversation& with);

}  // namespace palpate
