// Members of a struct or an enum as its header declares them, with their doc comments: what the reference
// says of constants that have no table but the header.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// A member of a struct, or an enumerator.
struct Member {
  std::string type;  ///< empty for an enumerator
  std::string name;
  std::string value;    ///< what it is set to, empty where the header doesn't say
  std::string comment;  ///< all `///` and `///<` of it, on one line
};

/// A struct or enum with the comment above it.
struct Declaration {
  std::string name;
  std::string comment;
  std::vector<Member> members;
};

/// Reads all structs and enums of a header of this source tree, in its order; `header` is as in an #include.
/// Takes declarations as clang-format writes them, one member a line; functions are left out. Throws Error.
[[nodiscard]] std::vector<Declaration> declarations_of(const std::filesystem::path& header);

/// The declaration of a name. Throws Error where there is none.
[[nodiscard]] const Declaration& declaration(const std::vector<Declaration>& all, const std::string& name);

}  // namespace palpate
