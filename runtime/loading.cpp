#include "runtime/loading.h"

#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "formats/model_file.h"
#include "meshes/error.h"
#include "runtime/output.h"

namespace palpate {
namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.is_open() || stream.bad()) {
    throw Error("cannot be read", file.string(),
                "give the model.toml that the file should have been made from");
  }
  return text;
}

}  // namespace

Body load_body(const std::filesystem::path& file, const std::filesystem::path& model_toml, int refinement,
               ContactModel contact) {
  Model model = load_model(file);
  if (!model_toml.empty() && read_text(model_toml) != model.model_toml) {
    throw Error("was not made from " + model_toml.string() + ": the description stored in it is another one",
                file.string(), "precompute it again: palpate-precompute " + model_toml.string());
  }
  for (const std::string& stale : stale_sources(model, file)) {
    print_warning(file.string() + ": " + stale + " (precompute it again)");
  }
  return Body(std::move(model), {}, refinement, contact);
}

}  // namespace palpate
