// Manual pages and completions of a program, made from its command line so that they cannot disagree with it.
#pragma once

#include <string>

#include "base/command_tree.h"

namespace palpate {

/// The manual page in section 1 (man(7)); `version` stands in its foot, `see_also` are pages it names.
[[nodiscard]] std::string man_page(const CommandText& program, const std::string& version,
                                   const std::vector<std::string>& see_also);

/// A script for bash 4 or later, without the package bash-completion.
[[nodiscard]] std::string bash_completion(const CommandText& program);

/// A file `_NAME` for a folder of zsh's fpath.
[[nodiscard]] std::string zsh_completion(const CommandText& program);

/// A file NAME.fish for fish 3.
[[nodiscard]] std::string fish_completion(const CommandText& program);

}  // namespace palpate
