#include "base/error.h"

#include <cctype>
#include <filesystem>
#include <new>
#include <system_error>

#include "base/printable.h"

namespace palpate {

std::string to_text(const Error& error) {
  std::string hint = error.hint();
  // Unless it begins with a name, such as edge_length or --jobs.
  const std::string first_word = hint.substr(0, hint.find(' '));
  if (first_word.find_first_of("_./-=") == std::string::npos && !hint.empty()) {
    hint[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(hint[0])));
  }
  const std::string where = error.where().empty() ? "" : printable(error.where()) + ": ";
  return "error: " + where + printable_lines(error.what(), "  ") + "\nhint: " + printable_lines(hint) + "\n";
}

Error handled_error(const std::string& where, const std::string& if_no_memory) {
  try {
    throw;
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return {"no more memory could be had", where, if_no_memory};
  } catch (const std::filesystem::filesystem_error& error) {
    return {"cannot be used: " + error.code().message(), error.path1().string(),
            "check the file, the links that lead to it and the rights of its folder"};
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) {
      return {
          "a thread could not be started", where,
          "Raise the limits on address space and processes (ulimit -v, ulimit -u, those of the container)"};
    }
    if (error.code() == std::errc::not_enough_memory)
      return {"no more memory could be had", where, if_no_memory};
    return {error.what(), where, "this is a defect of Palpate; please report it"};
  } catch (const std::exception& error) {
    return {error.what(), where, "this is a defect of Palpate; please report it"};
  }
}

}  // namespace palpate
