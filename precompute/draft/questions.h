// Description by questions and answers.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "precompute/draft/draft.h"

namespace palpate {

/// Streams of the questions and answers.
struct Conversation {
  std::istream& answers;
  std::ostream& questions;
  bool is_terminal = false;  ///< a wrong answer is asked for again; from a pipe it is an error
};

/// Asks for the data of a surface's or an image's description, each with a default that an empty line
/// accepts, and writes it as `draft` does. Asks for `file` if it is empty. Returns the description's file.
/// Throws Error as `draft` does, for a wrong answer from a pipe, and if the answers end too early.
std::filesystem::path draft_by_questions(std::filesystem::path file, DraftOptions options,
                                         const Conversation& with);

}  // namespace palpate
